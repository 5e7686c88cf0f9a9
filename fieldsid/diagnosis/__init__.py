"""The diagnosis of the physical effect that a model lacks, with its probability and the alternatives."""

from fieldsid.diagnosis.diagnose import diagnose
from fieldsid.diagnosis.records import Candidate, Diagnosis, Errors, Pair
from fieldsid.diagnosis.report.report_text import what_it_does

__all__ = ["Candidate", "Diagnosis", "Errors", "Pair", "diagnose", "what_it_does"]
