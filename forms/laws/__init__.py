"""One hyperelastic law per file, offered as ``LAW``; `forms.law.laws` finds them."""
