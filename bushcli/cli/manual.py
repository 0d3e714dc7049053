"""The manual page bushcli(1), made of the commands' own help: `python -m bushcli.cli.manual` prints it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

from bushcli import __version__
from bushcli.cli import main

_FILES = (
    ("case.toml", "A case: geometry, material, load cases, recordings; `bushcli init` writes an example."),
    ("DIR/report.html", "The page of a result; `bushcli view DIR` opens it."),
    ("DIR/result.json", "The result for scripts, as --json prints it."),
)
_VARIABLES = (
    ("BUSHCLI_CACHE", "Folder in which compiled kernels are stored."),
    ("OMP_NUM_THREADS", "Threads of the linear algebra; 1 if not set."),
)


def manual() -> str:
    """Return the page in the macros of man(7)."""
    context = click.Context(main, info_name="bushcli")
    head, *paragraphs = _paragraphs(main.help or "")
    lines = [
        '.\\" Made by bushcli.cli.manual from the help of the commands.',
        f'.TH BUSHCLI 1 "" "bushcli {__version__}" "User Commands"',
        ".SH NAME",
        f"bushcli \\- {_escape(head.rstrip('.').lower())}",
        ".SH SYNOPSIS",
        ".B bushcli",
        ".I COMMAND",
        "[\\fIOPTIONS\\fR] [\\fIARGUMENTS\\fR]",
        ".SH DESCRIPTION",
    ]
    for paragraph in paragraphs:
        lines += [".PP", _escape(paragraph)]
    lines.append(".SH COMMANDS")
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        if command is not None and not command.hidden:
            lines += _command(command, click.Context(command, info_name=name, parent=context))
    for title, entries in (("FILES", _FILES), ("ENVIRONMENT", _VARIABLES)):
        lines.append(f".SH {title}")
        for term, meaning in entries:
            lines += [".TP", f".B {_escape(term)}", _escape(meaning)]
    return "\n".join(lines) + "\n"


def _command(command: click.Command, context: click.Context) -> Iterator[str]:
    """Yield the lines of one command."""
    usage = " ".join(piece for piece in command.collect_usage_pieces(context))
    yield f".SS bushcli {_escape(command.name or '')} {_escape(usage)}"
    for paragraph in _paragraphs(command.help or ""):
        yield from (".PP", _escape(paragraph))
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None:
            yield from (".TP", f".B {_escape(record[0])}", _escape(record[1]))


def _paragraphs(text: str) -> list[str]:
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text.strip()) if part.strip()]


def _escape(text: str) -> str:
    """Return text with the characters escaped that man(7) would take for macros."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("±", "\\(+-").replace("`", "\\(ga")
    return f"\\&{text}" if text.startswith((".", "'")) else text


if __name__ == "__main__":
    click.echo(manual(), nl=False)
