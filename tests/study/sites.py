"""A study of small pictures with every kind of question, and a server of it."""

import contextlib
import threading
import time

import numpy as np
import uvicorn
from PIL import Image

from greensward.study.model import Study
from greensward.study.server import make_app
from greensward.study.store import Store

_YES_NO = [{"value": "yes", "text": "Yes"}, {"value": "no", "text": "No"}]
QUESTIONS = (
    {"name": "age", "kind": "number", "page": "you", "text": "How old are you?", "least": 1, "most": 120},
    {
        "name": "seen", "kind": "choice", "page": "you", "text": "What do you see?", "many": True, "other": True,
        "required": False, "options": _YES_NO, "note": "Look at anything.",
    },
    {"name": "best", "kind": "choice", "text": "Which is best?", "show": ["p0", "p1", "p2"], "options": _YES_NO},
    {"name": "real", "kind": "score", "text": "Is it real?", "show": ["p0"], "least_text": "No", "most_text": "Very"},
    {"name": "pair", "kind": "pairs", "text": "Which is a photograph?", "pictures": ["p0", "p1"], "ties": True},
    {
        "name": "stairs", "kind": "staircase", "text": "Which has more wind?", "reference": "p0",
        "levels": ["p1", "p2", "p3"], "reversals": 2, "most": 4,
    },
    {"name": "more", "kind": "text", "text": "What else?", "long": True, "required": False},
)  # fmt: skip


def study_in(folder, *questions, **keys):
    """A study of four small pictures in a folder."""
    random = np.random.default_rng(1)
    for number in range(4):
        image = np.clip(random.normal(90 + 20 * number, 25, (90, 160, 3)), 0, 255).astype(np.uint8)
        Image.fromarray(image).save(folder / f"p{number}.png")
    pictures = [{"name": f"p{number}", "file": f"p{number}.png", "alt": "Grass"} for number in range(4)]
    texts = {
        "title": "Does it look like grass?",
        "introduction": "You see pictures.\n\nIt is short.",
        "consent": "I agree.",
    }
    return Study(picture=pictures, question=questions or QUESTIONS, size=(160, 90), **{**texts, **keys})


@contextlib.contextmanager
def served(study, folder, database=None):
    """Serve a study from a thread; gives its address and its store."""
    with Store.open(folder, database) as store:
        config = uvicorn.Config(make_app(study, folder, store), port=0, log_level="error", access_log=False)
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run)
        thread.start()
        while not server.started:
            time.sleep(0.01)
        try:
            port = server.servers[0].sockets[0].getsockname()[1]
            yield f"http://127.0.0.1:{port}", store
        finally:
            server.should_exit = True
            thread.join()
