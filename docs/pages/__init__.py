"""What writes pages of the site from the program itself: reference, parts, validation, gallery."""
