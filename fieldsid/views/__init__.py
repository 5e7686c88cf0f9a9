"""How each kind of record is shown: one file per class of records with its `VIEW`, found by the registry; see `fieldsid.display`.

A file here imports other packages of fieldsid, pandas and matplotlib only inside the functions that need them, so that printing
one record does not load the modules of the others.
"""
