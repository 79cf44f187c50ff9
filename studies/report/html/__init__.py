"""The report as one self-contained page: templates, styles, and what fills them."""
