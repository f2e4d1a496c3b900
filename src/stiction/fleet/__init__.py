"""Many loops: block means of their signals, numbers of each loop, oscillations that loops share, and their source."""
