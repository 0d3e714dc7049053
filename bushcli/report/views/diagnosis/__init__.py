"""A diagnosis -> its document, with its sentences, its paragraph and its values."""

from bushcli.report.views.diagnosis.document import diagnosis_document

__all__ = ["diagnosis_document"]
