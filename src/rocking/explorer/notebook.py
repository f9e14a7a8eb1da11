"""The explorer in a notebook: the page of a response in a frame, served by the notebook's own process."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from rocking.errors import InvalidOption
from rocking.response import Response

if TYPE_CHECKING:
    from rocking.explorer.core import Explorer
    from rocking.explorer.launch import Served

#: Pages that may show the explorer in a frame: a notebook that this machine serves.
_NOTEBOOKS = "http://localhost:* http://127.0.0.1:*"


@dataclass(frozen=True)
class Frame:
    """The page of a response; a notebook shows it in a frame.

    Attributes
    ----------
    texts : mapping of str to str
        The case, as the page's address has it.
    height : int
        Of the frame, pixels.
    """

    texts: dict[str, str]
    height: int
    served: Served = field(repr=False)

    @property
    def link(self) -> str:
        """A link that opens the page once, in a browser on this machine."""
        return self.served.link(self.texts)

    def _repr_html_(self) -> str:
        query = urlencode({**self.texts, "token": self.served.guard.new_token()})
        # The cookie goes to frames of the notebook's own site only: the frame takes the name that the notebook has.
        choose = (
            "const frame = document.currentScript.previousElementSibling;"
            "const host = location.hostname === 'localhost' ? 'localhost' : '127.0.0.1';"
            f"frame.src = `http://${{host}}:{self.served.port}/?{query}`;"
        )
        style = f"width:100%;height:{self.height}px;border:0"
        return f'<iframe title="rocking explorer" style="{style}"></iframe><script>{choose}</script>'


_lock = threading.Lock()
_running: tuple[Explorer, Served] | None = None


def explore(response: Response, *, height: int = 760) -> Frame:
    """Show a response in the explorer, in a frame of the notebook.

    Parameters
    ----------
    response : Response
        From `rocking.simulate`.
    height : int
        Of the frame, pixels.

    Returns
    -------
    Frame
        As the last line of a cell it shows the page; `link` opens it in a browser.

    Raises
    ------
    InvalidOption
        If it is no response, or a package of the ``explorer`` extra is missing.

    Notes
    -----
    The page is served by this process on 127.0.0.1, so the notebook must be open on the same machine. It ends with
    the process.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
    >>> rocking.explore(response).texts["motion"]
    'one-sine:amplitude=3.0,frequency=1.0'
    """
    if not isinstance(response, Response):
        raise InvalidOption(f"a Response is needed, not a {type(response).__name__}: make one with rocking.simulate")
    from rocking.explorer.case import texts_of

    explorer, served = _server()
    return Frame(texts_of(response, explorer.shelf), height, served)


def _server() -> tuple[Explorer, Served]:
    """Return the one server of this process; the first call starts it."""
    global _running
    from rocking.explorer.core import Explorer
    from rocking.explorer.launch import served

    with _lock:
        if _running is None:
            explorer = Explorer()
            here = served(explorer, {}, framed_by=_NOTEBOOKS)
            here.run_in_background()
            _running = explorer, here
        return _running
