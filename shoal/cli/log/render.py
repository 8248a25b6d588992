"""`shoal log render`: takes pictures and their labels after the fact."""

from pathlib import Path

import click

from shoal.cli.log.export import default_output_name
from shoal.cli.log.log_input import LOG, errors_as_messages, open_log, progress_bar
from shoal.cli.optional_extra import require_extra
from shoal.cli.options import add_user_task_folders, code_of_log_option
from shoal.logs.inspect import format_noun_count
from support.atomic_files import new_folder
from support.terminal_text import printable


@click.command(
    epilog="Photos/ has the pictures and cameras.yaml, as the vehicle writes them. Labels/ has of each picture "
    ".class.png (8 bits), .instance.png (16 bits: the objects' numbers, 0 for none) and .npz: distance along the ray "
    "and depth along the axis (m, float32), and with --flow the way (px) to where a point is seen in the next picture "
    "of the camera. labels.json has the numbers of the classes, and the boxes of all objects."
)
@click.argument("log", type=LOG)
@click.argument("out", type=LOG, required=False)
@click.option("--camera", type=LOG, help="An ini file with sections like [Vision.Camera/Front]. [default: the log's]")
@click.option("--world", type=LOG, help="An ini file with [World], whose options replace those of the run.")
@click.option("--labels/--no-labels", default=True, help="Write labels, too.")
@click.option("--flow", is_flag=True, help="Include optical flow in the labels.")
@click.option("-j", "--processes", type=click.IntRange(min=1), help="How many render. [default: all processors]")
@code_of_log_option
def render(
    log: Path,
    out: Path | None,
    camera: Path | None,
    world: Path | None,
    labels: bool,
    flow: bool,
    processes: int | None,
    code: tuple[Path, ...],
) -> None:
    """Write what cameras see in the simulated run LOG to the new folder OUT: pictures and exact labels.

    The pictures of a virtual run are, byte for byte, those that the cameras would have taken in it.
    """
    add_user_task_folders(code, of_log=True)
    with errors_as_messages(), require_extra("vision"):
        from shoal.rendering import render_log as render_log  # needs NumPy and Pillow

        opened = open_log(log)
        out = out or Path(f"{default_output_name(opened.path)}-rendered")
        with new_folder(out) as part, progress_bar(opened.path, "rendering") as advance:
            done = render_log(
                opened,
                part,
                cameras=camera,
                world=world,
                labels=labels,
                flow=flow,
                processes=processes,
                progress=advance,
            )
    for note in done.notes:
        click.echo(printable(f"note: {note}"), err=True)
    each = ", ".join(f"{label} {count}" for label, count in done.pictures.items())
    click.echo(printable(f"{format_noun_count(sum(done.pictures.values()), 'picture')} in {out}: {each}"))
