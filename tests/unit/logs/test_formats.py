"""Formats of other programs: what their definitions say is proposed, and what is missing is said by its right name."""

import builtins
import importlib
import struct

import numpy as np
import pytest
from binary_logs import write_alog, write_dataflash, write_dbd, write_mat, write_ulog

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.readers.slocum import sniff

TIME = 0.1 * np.arange(300)
YAW = 0.4 * np.sin(0.3 * TIME)
EXTRAS = {
    "ulog": ("pyulog", write_ulog, "a ULog file (PX4)"),
    "ardupilot": ("pymavlink", write_dataflash, "a DataFlash log (ArduPilot)"),
    "slocum": ("dbdreader", write_dbd, "a Slocum glider's log"),
}


@pytest.mark.parametrize("extra", EXTRAS)
def test_without_its_library_a_format_is_refused_by_name_with_the_line_that_installs_it(tmp_path, monkeypatch, extra):
    library, write, what = EXTRAS[extra]
    log = write(tmp_path / "log", TIME, {"yaw_rad": YAW})
    found = importlib.import_module

    def without(name, *more):
        if name.partition(".")[0] == library:
            raise ModuleNotFoundError(f"No module named {library!r}", name=library)
        return found(name, *more)

    monkeypatch.setattr("fieldsid.logs.readers._topics.import_module", without)
    with pytest.raises(LogError) as error:
        inspect_log(log)
    assert what in error.value.what
    assert error.value.hint == f"install it: `pip install 'fieldsid[{extra}]'`"


def test_a_matlab_7_3_file_without_h5py_is_refused_by_name(tmp_path, monkeypatch):
    log = tmp_path / "log.mat"
    log.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n")
    found = importlib.import_module
    monkeypatch.setattr(
        "fieldsid.logs.readers._topics.import_module",
        lambda name: builtins.__import__("no_such_library") if name == "h5py" else found(name),
    )
    with pytest.raises(LogError, match=r"a MATLAB 7\.3 file") as error:
        inspect_log(log)
    assert "fieldsid[matlab]" in error.value.hint


def test_the_helms_variables_are_known_and_east_is_no_north(tmp_path):
    signals = {
        "NAV_HEADING": np.degrees(YAW) % 360,
        "NAV_X": 2.0 * TIME,
        "NAV_Y": 1.0 * TIME,
        "DESIRED_RUDDER": 10 * np.sign(YAW),
    }
    run = inspect_log(write_alog(tmp_path / "a.alog", TIME, signals | {"DESIRED_HEADING": 0 * TIME})).run
    np.testing.assert_allclose(run["y_m"], 2.0 * TIME, atol=1e-9)
    np.testing.assert_allclose(run["x_m"], 1.0 * TIME, atol=1e-9)
    np.testing.assert_allclose(run["yaw_rad"], YAW, atol=1e-6)
    assert run.has("rudder_rad")


def test_of_a_gliders_sensors_only_those_of_the_dictionary_are_taken(tmp_path):
    signals = {
        "m_heading": YAW,
        "c_heading": 0 * YAW,
        "cc_final_heading_value": 0 * YAW,
        "m_fin": YAW,
        "x_hd_fin_ap_gain": 0 * YAW,
    }
    found = inspect_log(write_dbd(tmp_path / "a.dbd", TIME, signals))
    assert {s: i["topic"] for s, i in found.proposal.body["signals"].items()} == {
        "yaw_rad": "m_heading",
        "yaw_goal_rad": "c_heading",
        "rudder_measured_rad": "m_fin",
    }


def test_a_glider_log_without_its_list_of_sensors_names_the_file(tmp_path):
    log = write_dbd(tmp_path / "a.dbd", TIME, {"m_heading": YAW})
    log.write_bytes(log.read_bytes().replace(b"factored:    0", b"factored:    1"))
    with pytest.raises(LogError, match="list of its sensors") as error:
        load_run(log, _by("m_heading"))
    assert "0A0B0C0D.cac" in error.value.found


def _by(topic):
    from fieldsid.logs.mapping.mapping_file import mapping_of

    return mapping_of({"signals": {"yaw_rad": {"topic": topic, "field": "data"}}})


def test_a_struct_in_a_matlab_file_is_a_table_and_a_canonical_one_needs_no_mapping(tmp_path):
    run = load_run(write_mat(tmp_path / "a.mat", TIME, {"yaw_rad": YAW, "rudder_rad": YAW > 0}))
    np.testing.assert_array_equal(run["yaw_rad"], YAW)


def test_a_matlab_file_without_columns_says_what_to_save(tmp_path):
    import scipy.io

    scipy.io.savemat(tmp_path / "a.mat", {"gain": 2.0, "name": "x"})
    with pytest.raises(LogError, match="no columns of numbers") as error:
        load_run(tmp_path / "a.mat")
    assert "table2struct" in error.value.hint


@pytest.mark.parametrize("suffix", ["ulg", "bin", "dbd", "mat"])
def test_garbage_behind_a_signature_is_an_error_with_its_name(tmp_path, suffix):
    heads = {
        "ulg": b"ULog\x01\x12\x35\x01" + bytes(8),
        "bin": b"\xa3\x95\x80",
        "dbd": b"dbd_label: DBD(dinkum_binary_data)file\nsensor_list_factored: 0\n",
        "mat": b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49),
    }
    log = tmp_path / f"log.{suffix}"
    log.write_bytes(heads[suffix] + np.random.default_rng(4).bytes(3000))
    with pytest.raises(LogError) as error:
        load_run(log, _by("m_heading"))
    assert str(log) in error.value.what


def test_a_gliders_log_as_text_is_left_to_the_reader_of_text(tmp_path):
    log = tmp_path / "a.dba"
    log.write_text("dbd_label: DBD_ASC(dinkum_binary_data_ascii)file\nencoding_ver: 2\nnum_ascii_tags: 14\n")
    assert not sniff(log)


@pytest.mark.parametrize("tags", ["", "num_ascii_tags: 14\n", "a: 1\nb: 2\nc: 3\nnum_ascii_tags: 2\n"])
def test_a_gliders_log_whose_head_is_cut_is_refused_before_it_is_read(tmp_path, tags):
    log = tmp_path / "a.dbd"
    log.write_text(f"dbd_label: DBD(dinkum_binary_data)file\nencoding_ver: 5\n{tags}")
    with pytest.raises(LogError) as refused:
        inspect_log(log)
    assert "cannot be read" in refused.value.what
    assert "lines in its first" in refused.value.found
