"""What mkdocs runs: pages that are made from the program join those that are written."""

import contextlib
import hashlib
import io
import os
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
sys.path.insert(0, str(ROOT / "src"))
os.environ["JAX_ENABLE_X64"] = "1"
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MPLBACKEND", "Agg")

from mkdocs.structure.files import File, Files

from pages import names, parts, reference

CACHE = ROOT / ".cache" / "site"
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)
README = "<!-- readme -->"
CODE = re.compile(r"(<a [^>]*>)?<code>(jr\.)?([A-Za-z][\w.]*?)(\([^<]*\))?</code>")
BY_PLACE = {place: name for name in names.public() for place in name.places}


def on_files(files: Files, config: Any) -> Files:
    for path, text in reference.pages():
        files.append(File.generated(config, path, content=text))
    for page in sorted((ROOT / "docs" / "parts").glob("*.md")):
        for name, png in pictures(page.read_text(encoding="utf-8")).items():
            files.append(File.generated(config, f"parts/{page.stem}-{name}.png", content=png))
    return files


def on_nav(nav: Any, config: Any, files: Files) -> Any:
    return nav


def on_config(config: Any) -> Any:
    """The reference is one list of the navigation; its pages are known once the program is read."""
    pages = [path for path, _ in reference.pages()]
    own = [{reference.TITLES.get(p := Path(path).stem, p): path} for path in pages[1:]]
    config.nav.append({"Reference": [pages[0], *own]})
    return config


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    here = Path(page.file.src_uri)
    if README in markdown:
        markdown = markdown.replace(README, readme())

    def told(found: re.Match[str]) -> str:
        picture = found["picture"]
        return parts.section(
            BY_PLACE[found["place"]], f"{here.stem}-{picture}.png" if picture else ""
        )

    markdown = parts.MARK.sub(told, markdown)
    # what lies outside the pages is named, not linked
    return re.sub(r"\[([^\]]*)\]\(\.\./(?:\.\./)*(?:[A-Z]+\.md|(?:src|tests|experiments|configs)/[^)]*)\)",
                  r"\1", markdown)  # fmt: skip


def on_page_content(html: str, page: Any, config: Any, files: Files) -> str:
    """`jr.Rotor` in running text leads to its place in the reference."""
    up = "../" * page.file.src_uri.count("/")

    def linked(found: re.Match[str]) -> str:
        inside, jr, place, call = found.groups()
        name = BY_PLACE.get(place)
        plain = name is not None and (jr or place[0].isupper() or call)
        if inside or not plain:
            return found[0]
        target = name.link.replace(".md#", ".html#")
        return f'<a href="{up}{target}">{found[0]}</a>'

    return html if page.file.src_uri.startswith("api/") else CODE.sub(linked, html)


def readme() -> str:
    """Without its title, with links as seen from the site's first page."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").split("\n", 1)[1]
    return text.replace("](docs/", "](")


def pictures(text: str) -> dict[str, bytes]:
    """Those that the marks of a page ask for, from its own code; kept until the page or a part changes."""
    wanted = {found["picture"] for found in parts.MARK.finditer(text)} - {None}
    if not wanted:
        return {}
    known = hashlib.sha256(text.encode())
    for file in sorted([*names.SOURCE.glob("elements/**/*.py"), *names.SOURCE.glob("profiles/*.py"),
                        names.SOURCE / "plot" / "machine.py", Path(__file__).with_name("pictures.py")]):  # fmt: skip
        known.update(file.read_bytes())
    folder = CACHE / known.hexdigest()[:16]
    if os.environ.get("JAXROTOR_SITE_PICTURES") == "off":  # for the test of all else
        return dict.fromkeys(wanted, b"")
    if not all((folder / f"{name}.png").is_file() for name in wanted):
        from pages.pictures import png

        space: dict[str, Any] = {}
        with contextlib.redirect_stdout(io.StringIO()):
            for code in BLOCK.findall(text):
                exec(code, space)
        folder.mkdir(parents=True, exist_ok=True)
        for name in wanted:
            (folder / f"{name}.png").write_bytes(png(space[name]))
    return {name: (folder / f"{name}.png").read_bytes() for name in wanted}
