"""Files of measuring programs: one reader a format, each of which gives a table of columns."""
