"""Results -> documents, with their words; one file per result, and nothing here loads rich, Jinja or Matplotlib."""
