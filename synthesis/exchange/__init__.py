"""Models and tables as files, and from and to the objects of other tools."""
