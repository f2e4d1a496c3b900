"""What a page says, as blocks: each built once, and drawn by HTML, the terminal and the web page."""
