"""The study `consistency`: whether the standard deviations of the whole pipeline are true."""
