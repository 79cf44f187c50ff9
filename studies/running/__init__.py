"""Running studies: parts on worker processes, stored whole, resumed where they stopped, collected into results."""
