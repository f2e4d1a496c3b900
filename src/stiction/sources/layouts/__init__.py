"""Table layouts: one page each with `recognises(table, options)` and `read(table, options)`."""
