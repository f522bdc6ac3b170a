"""What the site needs beyond MkDocs: links that leave docs/, and Markdown read as the host reads it.

Links to files outside docs/ work on the repository's host. On the site they lead to the repository, if
the file exists. MkDocs reads some Markdown differently from the host: such text ends up as a paragraph
with its marks, and is reported. Both are warnings, which `mkdocs build --strict` makes errors.
"""

import logging
import pathlib
import posixpath
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Warnings of this logger count for --strict.
log = logging.getLogger("mkdocs.hooks")


def on_page_markdown(markdown, page, config, files):
    """Leads links to files that are not part of the site to the repository."""

    def to_repository(found):
        text, path, anchor = found[1], found[2], found[3] or ""
        target = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page.file.src_uri), path))
        file = files.get_file_from_path(target.removeprefix("docs/"))
        is_on_site = target.startswith("docs/") and file and not file.inclusion.is_excluded()
        if is_on_site or not (ROOT / target).exists():
            return found[0]
        kind = "tree" if (ROOT / target).is_dir() else "blob"
        return f"{text}({config.repo_url}/{kind}/main/{target}{anchor})"

    return re.sub(r"(\[[^\]]*\])\(([^)#:\s]+)(#[^)\s]*)?\)", to_repository, markdown)


def on_page_content(html, page, config, files):
    """Reports lists, tables and blocks of code that were not recognized."""
    text = re.sub(r"<(pre|code)[^>]*>.*?</\1>", "", html, flags=re.DOTALL)
    for paragraph in re.findall(r"<(?:p|li)>(.*?)</(?:p|li)>", text, re.DOTALL):
        mark = re.search(r"```|^\s*([-*] |1\. |\|)", paragraph, re.MULTILINE)
        if mark:
            log.warning("%s: not rendered as on the host: %s", page.file.src_uri, paragraph[:200])
    return html
