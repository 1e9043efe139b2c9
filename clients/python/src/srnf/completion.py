"""Scripts by which shells complete the command ``srnf``, from its parser."""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh", "fish")

_BASH = """\
# srnf: put it into ~/.local/share/bash-completion/completions/srnf, or run: source <(srnf completion bash)
_srnf() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command= one
    for one in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        case $one in {commands}) command=$one && break ;; esac
    done
    case $command:$before in
{choices}
    esac
    if [[ $word == -* ]]; then
        case $command in
{options}
        *) COMPREPLY=($(compgen -W "{top}" -- "$word")) ;;
        esac
    elif [ -z "$command" ]; then
        COMPREPLY=($(compgen -W "{words}" -- "$word"))
    else
        COMPREPLY=($(compgen -f -- "$word"))
    fi
}}
complete -o filenames -F _srnf srnf"""


def _commands(top: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def _options(one: argparse.ArgumentParser) -> list[str]:
    return [name for action in one._actions for name in action.option_strings if name.startswith("--")]


def _chosen(one: argparse.ArgumentParser) -> list[tuple[list[str], list[str]]]:
    return [(list(a.option_strings), [str(c) for c in a.choices]) for a in one._actions if a.choices and a.option_strings]


def _bash(top: argparse.ArgumentParser) -> str:
    commands = _commands(top)
    options = [f'        {name}) COMPREPLY=($(compgen -W "{" ".join(_options(one))}" -- "$word")) ;;'
               for name, one in commands.items()]  # fmt: skip
    reply = '    {}:{}) COMPREPLY=($(compgen -W "{}" -- "$word")); return ;;'
    choices = [
        reply.format(name, option, " ".join(values))
        for name, one in commands.items()
        for names, values in _chosen(one)
        for option in names
    ]
    choices.append(reply.format("completion", "completion", " ".join(SHELLS)))
    return _BASH.format(
        commands=" | ".join(commands),
        words=" ".join(commands),
        top=" ".join(_options(top)),
        options="\n".join(options),
        choices="\n".join(choices),
    )


def _zsh(top: argparse.ArgumentParser) -> str:
    return "#compdef srnf\nautoload -U +X bashcompinit && bashcompinit\n" + _bash(top)


def _fish(top: argparse.ArgumentParser) -> str:
    lines = ["# srnf: put it into ~/.config/fish/completions/srnf.fish"]
    helps = {}
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {one.dest: one.help or "" for one in action._choices_actions}
    for name, one in _commands(top).items():
        text = helps.get(name, "").replace("'", "")
        lines.append(f"complete -c srnf -n __fish_use_subcommand -f -a {name} -d '{text}'")
        for action in one._actions:
            for option in action.option_strings:
                if option.startswith("--"):
                    line = f"complete -c srnf -n '__fish_seen_subcommand_from {name}' -l {option[2:]}"
                    values = " ".join(str(c) for c in action.choices) if action.choices else ""
                    lines.append(line + (f" -x -a '{values}'" if values else ""))
    lines.append(f"complete -c srnf -n '__fish_seen_subcommand_from completion' -f -a '{' '.join(SHELLS)}'")
    return "\n".join(lines)


def script(shell: str, top: argparse.ArgumentParser) -> str:
    """The script of a shell: one of ``SHELLS``."""
    return {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](top)
