"""Running studies: parts computed on worker processes, stored whole, resumed where they stopped, collected into results."""
