"""The pages of help, shell completion, and the pages of the guide on a terminal."""
