"""Time stamps to seconds, and rows to an even grid."""
