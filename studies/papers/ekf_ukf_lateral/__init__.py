"""P4, Doumiati et al. 2009: four-wheel model with Dugoff tires, extended against unscented filter."""
