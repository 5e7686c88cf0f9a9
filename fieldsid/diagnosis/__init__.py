"""Which physical effect is missing, how sure that is, and what it could be instead."""

from fieldsid.diagnosis.diagnose import body_of, diagnose
from fieldsid.diagnosis.records import Candidate, Diagnosis, Errors, Pair

__all__ = ["Candidate", "Diagnosis", "Errors", "Pair", "body_of", "diagnose"]
