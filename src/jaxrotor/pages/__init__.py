"""Results as one HTML page that needs nothing else: figures that zoom, tables, the study as written."""
