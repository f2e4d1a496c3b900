"""The local web page of `stiction serve`: server, worker processes, screens. It computes nothing by itself."""
