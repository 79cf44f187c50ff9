"""Hooks of MkDocs: run the pages before they are drawn, and add what the code makes."""

from __future__ import annotations

import posixpath
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

from docs.tools.fences import with_outputs
from docs.tools.pages import PICTURES, page_texts
from docs.tools.reference import reference_pages
from docs.tools.running import run_pages


def on_files(files: Files, config: Any) -> Files:
    """Every page as its run leaves it, the pictures that it drew, and the reference."""
    written = page_texts()
    runs = run_pages(written)
    if failures := [run.failure for run in runs.values() if run.failure]:
        raise PluginError("\n".join(failures))
    made = {place: with_outputs(text, runs[place].outputs) for place, text in written.items()} | reference_pages()
    for place, text in made.items():
        _put(files, File.generated(config, place, content=text))
    for place, picture in PICTURES.items():
        _put(files, File.generated(config, place, content=picture.read_bytes()))
    for place, run in runs.items():
        for name, picture in run.pictures.items():
            if f"({name})" in written[place]:
                _put(files, File.generated(config, posixpath.join(posixpath.dirname(place), name), content=picture))
    return files


def _put(files: Files, file: File) -> None:
    if old := files.get_file_from_path(file.src_uri):
        files.remove(old)
    files.append(file)
