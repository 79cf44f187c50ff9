"""The study `against-wheels`: V_x of the default pipeline beside the wheels and the corner observers, drive by drive."""
