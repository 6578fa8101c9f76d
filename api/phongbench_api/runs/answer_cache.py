"""Answers given before."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any


class AnswerCache:
    """The `entries` answers used last, by a key of the question and the state of the files it was answered from."""

    def __init__(self, entries: int = 256) -> None:
        self._entries, self._answers = entries, OrderedDict[Hashable, Any]()
        self._lock = threading.Lock()

    def get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """The answer stored under this key, or a new one; two threads may make the same one at once."""
        with self._lock:
            if key in self._answers:
                self._answers.move_to_end(key)
                return self._answers[key]
        made = make()
        with self._lock:
            self._answers[key] = made
            while len(self._answers) > self._entries:
                self._answers.popitem(last=False)
        return made
