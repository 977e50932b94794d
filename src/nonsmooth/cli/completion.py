"""``nonsmooth completion SHELL``: completion of commands, options and their values for bash, zsh and fish."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable
from typing import Any, NamedTuple

_NAME = "nonsmooth"


class _Command(NamedTuple):
    name: str
    text: str
    arguments: list[argparse.Action]

    @property
    def words(self) -> str:
        """Words that the positional arguments take; a model or a study file may also be the name of a file."""
        return " ".join(word for item in self.arguments if not item.option_strings for word in _values(item) or ())


def add(commands: Any) -> Any:
    """Declare the sub-command."""
    parser = commands.add_parser(
        "completion",
        help="print the completion script of a shell",
        description="Print a script that lets a shell complete commands, options and names.",
        epilog="examples:\n"
        '  eval "$(nonsmooth completion bash)"       # in ~/.bashrc\n'
        '  eval "$(nonsmooth completion zsh)"        # in ~/.zshrc, after compinit\n'
        "  nonsmooth completion fish > ~/.config/fish/completions/nonsmooth.fish",
    )
    parser.add_argument("shell", choices=sorted(_SCRIPTS), help="the shell")
    return parser


def run(options: argparse.Namespace) -> int:
    from nonsmooth.cli.main import parser

    print(completion(parser(), options.shell))
    return 0


def completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script for a shell, made from the parser's commands and options."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    texts = {action.dest: action.help or "" for action in commands._choices_actions}
    known = [_Command(name, texts[name], _arguments(item)) for name, item in commands.choices.items()]
    top = [item for item in _arguments(parser) if item.option_strings]
    return _SCRIPTS[shell](known, top)


def _arguments(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if not isinstance(action, argparse._SubParsersAction)]


def _flags(items: list[argparse.Action]) -> str:
    return " ".join(flag for item in items for flag in item.option_strings)


def _text(action: argparse.Action) -> str:
    """The first words of its help."""
    return (action.help or "").split(" (")[0].split(";")[0].replace("`", "")


def _values(action: argparse.Action) -> tuple[str, ...] | None:
    """Words that an argument takes; None: names of files."""
    from nonsmooth import models
    from nonsmooth.studies import installed

    if action.choices is not None:
        return tuple(map(str, action.choices))
    if action.metavar == "MODEL" or action.dest == "model":
        return models.names()
    if action.metavar == "STUDY":
        return tuple(sorted(installed()))
    return None


def _bash(commands: list[_Command], top: list[argparse.Action]) -> str:
    lines = [
        f"# Completion of {_NAME} in bash.",
        f"_{_NAME}() {{",
        '    local word="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}"',
        '    local command="" words="" flags="" i',
        "    for ((i = 1; i < COMP_CWORD; i++)); do",
        '        case "${COMP_WORDS[i]}" in',
        f'            {"|".join(command.name for command in commands)}) command="${{COMP_WORDS[i]}}"; break ;;',
        "        esac",
        "    done",
        '    case "$command" in',
        f'        "") words="{" ".join(command.name for command in commands)}"',
        f'            flags="{_flags(top)}" ;;',
        *(f'        {one.name}) words="{one.words}"; flags="{_flags(one.arguments)}" ;;' for one in commands),
        "    esac",
        '    case "$command $previous" in',
    ]
    for command in commands:
        for item in command.arguments:
            if item.option_strings and item.nargs != 0:
                given = "|".join(f'"{command.name} {flag}"' for flag in item.option_strings)
                lines.append(f'        {given}) words="{" ".join(_values(item) or ())}" ;;')
    lines += [
        "    esac",
        '    if [[ "$word" == -* ]]; then words="$flags"; fi',
        "    # where nothing fits, readline completes names of files",
        '    COMPREPLY=($(compgen -W "$words" -- "$word"))',
        "}",
        f"complete -o default -o filenames -F _{_NAME} {_NAME}",
    ]
    return "\n".join(lines)


def _zsh(commands: list[_Command], top: list[argparse.Action]) -> str:
    def marked(text: str) -> str:
        return "".join(f"\\{letter}" if letter in "[]:\\" else letter for letter in text)

    def specification(item: argparse.Action) -> list[str]:
        known = _values(item)
        values = "_files" if known is None else f"({' '.join(known)})"
        if not item.option_strings:
            return [shlex.quote(f":{marked(_text(item)) or 'argument'}:{values}")]
        value = f":value:{values}" if item.nargs != 0 else ""
        return [shlex.quote(f"{flag}[{marked(_text(item))}]{value}") for flag in item.option_strings]

    def arguments(items: list[argparse.Action]) -> str:
        return " \\\n            ".join(part for item in items for part in specification(item))

    lines = [
        f"#compdef {_NAME}",
        f"_{_NAME}() {{",
        "    local -a commands",
        "    commands=(",
        *(f"        {shlex.quote(f'{marked(command.name)}:{marked(command.text)}')}" for command in commands),
        "    )",
        "    local -i at=2",
        "    while (( at < CURRENT )) && [[ ${words[at]} == -* ]]; do (( at++ )); done",
        "    if (( at >= CURRENT )); then",
        f"        _describe command commands; _arguments {arguments(top)}",
        "        return",
        "    fi",
        "    local command=${words[at]}",
        '    words=("${(@)words[at,-1]}"); (( CURRENT -= at - 1 ))  # empty words stay',
        "    case $command in",
    ]
    for command in commands:
        lines += [f"        {command.name}) _arguments \\\n            {arguments(command.arguments)} ;;"]
    lines += [
        "    esac",
        "}",
        f'if [[ ${{funcstack[1]}} == _{_NAME} ]]; then _{_NAME} "$@"; else compdef _{_NAME} {_NAME}; fi',
    ]
    return "\n".join(lines)


def _fish(commands: list[_Command], top: list[argparse.Action]) -> str:
    def line(condition: str, item: argparse.Action) -> str:
        parts = ["complete", "-c", _NAME, "-n", condition]
        for flag in item.option_strings:
            parts += ["-l", flag[2:]] if flag.startswith("--") else ["-s", flag[1:]]
        if (values := _values(item)) is not None:
            parts += ["-a", " ".join(values)]
        if item.option_strings and item.nargs != 0:
            parts.append("-r")
        if _text(item):
            parts += ["-d", _text(item)]
        return " ".join(map(shlex.quote, parts))

    lines = [f"# Completion of {_NAME} in fish."]
    lines += [line("__fish_use_subcommand", item) for item in top]
    for command in commands:
        named = ["complete", "-c", _NAME, "-f", "-n", "__fish_use_subcommand", "-a", command.name, "-d", command.text]
        lines.append(" ".join(map(shlex.quote, named)))
        here = f"__fish_seen_subcommand_from {command.name}"
        lines += [line(here, item) for item in command.arguments if item.option_strings or _values(item)]
    return "\n".join(lines)


_SCRIPTS: dict[str, Callable[[list[_Command], list[argparse.Action]], str]] = {
    "bash": _bash,
    "fish": _fish,
    "zsh": _zsh,
}
