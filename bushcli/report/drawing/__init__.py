"""Drawing: a `Plot` with Matplotlib, for files, and as zoomable SVG, for the page; bodies and maps as pictures."""
