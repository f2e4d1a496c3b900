"""File formats: one page each with `recognises(head, name)` and `read(source, options)`."""
