"""Files that save work when they are there and whole; what is missing or damaged is made again."""

import contextlib
import hashlib
from pathlib import Path

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import replacing

DIGEST = hashlib.sha256().digest_size


def store(path: Path, content: bytes) -> None:
    """Keep `content` with its digest. A cache that cannot be written costs time on the next run, nothing else."""
    with contextlib.suppress(OSError, JaxmotorError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)


def stored(path: Path) -> bytes | None:
    """What `store` put into `path`; None where there is nothing, or not all of it."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, kept = content[:DIGEST], content[DIGEST:]
    return kept if hashlib.sha256(kept).digest() == digest else None
