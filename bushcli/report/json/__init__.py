"""Results -> JSON-ready data, on which scripts rely; one file per result."""
