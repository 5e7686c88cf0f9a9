"""Times of a table as seconds that go on."""
