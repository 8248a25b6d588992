"""Scripts with which bash and fish complete words; zsh has that of click."""

import os

from click.shell_completion import BashComplete, FishComplete, add_completion_class, split_arg_string

BASH = r"""%(complete_func)s() {
    local line=${COMP_LINE:0:COMP_POINT} breaks=${COMP_WORDBREAKS//[^=:]/} word head="" type value
    word=${line##*[[:space:]]}
    [[ -n $breaks ]] && head=${word%%"${word##*[$breaks]}"}
    COMPREPLY=()
    while IFS=, read -r type value; do
        case $type in
            dir) compopt -o dirnames ;;
            file) compopt -o default ;;
            plain)
                [[ $line == *[\"\']* ]] || printf -v value %%q "$value"
                value=${value//\\,/,}
                [[ $value == *[=:] ]] && compopt -o nospace
                COMPREPLY+=("${value#*"$head"}")
                ;;
        esac
    done < <(COMP_WORDS=$line %(complete_var)s=bash_complete "$1")
}
complete -o nosort -F %(complete_func)s %(prog_name)s
"""

FISH = r"""function %(complete_func)s
    set -lx COMP_WORDS (commandline -cp)
    set -lx COMP_CWORD (commandline -ct)
    for answer in (%(complete_var)s=fish_complete %(prog_name)s)
        set -l parts (string split --max 1 , -- $answer)
        switch $parts[1]
            case dir
                __fish_complete_directories $parts[2]
            case file
                __fish_complete_path $parts[2]
            case plain
                echo $parts[2]
        end
    end
end
complete --no-files --command %(prog_name)s --arguments "(%(complete_func)s)"
"""


class BashCompletion(BashComplete):
    """Completes words with `=` and `:`, at which bash begins another one, and quotes blanks."""

    source_template = BASH

    def get_completion_args(self) -> tuple[list[str], str]:
        """The words before the cursor, and the last one as far as it is written."""
        line = os.environ["COMP_WORDS"]
        words = split_arg_string(line)
        is_begun = bool(words) and (not line[-1:].isspace() or line.endswith("\\ "))
        incomplete = words.pop() if is_begun else ""
        return words[1:], incomplete


class FishCompletion(FishComplete):
    """Completes words with commas."""

    source_template = FISH


def use_own_scripts() -> None:
    """Let click use these scripts."""
    add_completion_class(BashCompletion)
    add_completion_class(FishCompletion)
