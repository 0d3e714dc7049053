"""Protocol of a test, compared with standards and with the recordings that each question requires.

`observed` lists the contents of a recording: cycles, rates, holds, rest. `library` has one file per standard; a case
names the standard that a recording claims to follow. `questions` says which effects the recordings of a case cannot
distinguish, and why.
"""

from bushcli.standards.observed import Observed, observe
from bushcli.standards.questions import Lack, open_questions
from bushcli.standards.standard import Clause, Standard, clauses, standards

__all__ = ["Clause", "Lack", "Observed", "Standard", "clauses", "observe", "open_questions", "standards"]
