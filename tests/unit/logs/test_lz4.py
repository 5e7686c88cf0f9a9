"""A cut LZ4 frame gives a true beginning of what was packed, and nearly all of it."""

import lz4.frame
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.logs.readers._lz4 import lz4_left

rng = np.random.default_rng(5)
WORDS = [rng.bytes(n) for n in (3, 8, 20, 60)]
PLAIN = b"".join(WORDS[i] + bytes([i]) * int(k) for i, k in zip(rng.integers(0, 4, 8000), rng.integers(0, 30, 8000), strict=True))


def packed(**form):
    return lz4.frame.compress(PLAIN, **form)


FORMS = [
    {},
    {"block_size": lz4.frame.BLOCKSIZE_MAX4MB},
    {"block_linked": False},
    {"block_checksum": True, "store_size": False},
    {"content_checksum": True, "compression_level": 9},
]


@pytest.mark.parametrize("form", FORMS, ids=str)
@pytest.mark.parametrize("share", [0.05, 0.3, 0.7, 0.95, 0.999])
def test_what_is_left_is_the_beginning_and_no_shorter_than_the_data_allow(form, share):
    data = packed(**form)
    left = lz4_left(data[: int(share * len(data))])
    assert PLAIN.startswith(left)
    assert len(left) > 0.5 * share * len(PLAIN)


@pytest.mark.parametrize("form", FORMS, ids=str)
def test_a_whole_frame_is_whole(form):
    assert lz4_left(packed(**form)) == PLAIN


@given(st.binary(max_size=300), st.integers(0, 320))
def test_any_bytes_cut_anywhere_give_a_beginning(plain, cut):
    left = lz4_left(lz4.frame.compress(plain, store_size=False)[:cut])
    assert left is None or plain.startswith(left)


@given(st.binary(max_size=200))
def test_bytes_that_are_no_frame_are_none_or_nothing_and_never_a_crash(data):
    assert lz4_left(data) is None or isinstance(lz4_left(data), bytes)
