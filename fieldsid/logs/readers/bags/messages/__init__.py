"""The messages inside bags: their definitions, and the numbers at a field's place."""
