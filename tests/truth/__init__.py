"""A second implementation of the vehicle and of every effect, written apart from fieldsid: nothing here imports it."""
