"""Claims about a deployed loop: what each says, how it is searched for, and how it is proved without a solver."""
