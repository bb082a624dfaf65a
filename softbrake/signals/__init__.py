"""Records of drop tests: files of measured channels, read into and written from one form."""
