"""Where records come from: files, frames and databases."""
