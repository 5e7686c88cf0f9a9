"""Formats of other programs: what their definitions say is proposed, and what is missing is said by its right name."""

import builtins
import gzip
import importlib
import struct

import numpy as np
import pytest
import scipy.io
from binary_logs import imc_message, write_alog, write_dataflash, write_dbd, write_lsf, write_mat, write_ulog

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of
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
    return mapping_of({"signals": {"yaw_rad": {"topic": topic, "field": "data"}}})


def test_a_struct_in_a_matlab_file_is_a_table_and_a_canonical_one_needs_no_mapping(tmp_path):
    run = load_run(write_mat(tmp_path / "a.mat", TIME, {"yaw_rad": YAW, "rudder_rad": YAW > 0}))
    np.testing.assert_array_equal(run["yaw_rad"], YAW)


def test_rows_that_a_script_made_room_for_and_never_filled_are_no_rows(tmp_path):
    path, filled, room = tmp_path / "log.mat", TIME.size, 5 * TIME.size
    columns = {"t": TIME + 0.3, "heading": np.degrees(YAW) + 40.0, "u": np.stack([YAW] * 4, axis=1)}
    scipy.io.savemat(path, {n: np.concatenate([v, np.zeros((room - filled, *v.shape[1:]))]) for n, v in columns.items()})
    found = inspect_log(path)
    assert found.run is not None
    assert found.run.time.size == filled
    assert "surge_m_s" not in found.proposal.body["signals"]  # one of four inputs is no speed for being called u


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


def test_a_damaged_dataflash_log_says_once_where_and_nothing_of_its_librarys_own(tmp_path, capfd):
    path = tmp_path / "log.bin"
    write_dataflash(path, TIME, {"yaw_rad": YAW, "rudder_rad": 0.1 * np.sign(YAW)})
    data = bytearray(path.read_bytes())
    data[3000:3040] = b"\xff" * 40
    path.write_bytes(data)
    assert [n.code for n in inspect_log(path).notes].count("truncated") == 1
    assert capfd.readouterr() == ("", "")


def test_a_damaged_ulog_says_so_itself_and_nothing_of_its_librarys_own(tmp_path, capfd):
    path = tmp_path / "log.ulg"
    write_ulog(path, TIME, {"yaw_rad": YAW, "rudder_rad": 0.1 * np.sign(YAW)})
    data = bytearray(path.read_bytes())
    one = data.rindex(b"D\x07\0", 0, 3000)  # a message of data, given to a topic that there is not
    data[one + 1 : one + 3] = b"\xff\x7f"
    path.write_bytes(data)
    assert "damaged" in {n.code for n in inspect_log(path).notes}
    assert capfd.readouterr() == ("", "")


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


STATE = {"psi": YAW, "r": np.gradient(YAW, TIME), "u": 0.0 * TIME + 1.5}


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [False, True])
def test_the_messages_of_a_dune_log_are_those_of_the_definition_beside_it(tmp_path, order, packed):
    log = write_lsf(tmp_path / "Data.lsf", TIME, {**STATE, "rudder_rad": 0.2 * np.sign(YAW)}, order=order)
    if packed:
        log.with_suffix(".lsf.gz").write_bytes(gzip.compress(log.read_bytes()))
        log = log.with_suffix(".lsf.gz")
        (tmp_path / "IMC.xml.gz").write_bytes(gzip.compress((tmp_path / "IMC.xml").read_bytes()))
        (tmp_path / "IMC.xml").unlink()
    found = inspect_log(log)
    assert {c.name for c in found.inventory.channels} == {
        "EntityState",
        "EstimatedState",
        "SetServomotorPosition[1]",
        "SetServomotorPosition[2]",
    }
    signals = found.proposal.body["signals"]
    assert {s: i["field"] for s, i in signals.items()} == {
        "yaw_rad": "psi",
        "yaw_rate_rad_s": "r",
        "surge_m_s": "u",
        "rudder_rad": "value",
    }
    assert signals["rudder_rad"]["topic"] == "SetServomotorPosition[2]"
    body = {**found.proposal.body, "signals": {**signals, "rudder_rad": {"topic": "SetServomotorPosition[2]", "field": "value"}}}
    run = load_run(log, mapping_of(body))
    np.testing.assert_allclose(run["yaw_rad"], YAW, atol=1e-12)
    np.testing.assert_allclose(run["rudder_rad"], 0.2 * np.sign(YAW), atol=1e-7)
    np.testing.assert_allclose(run.time, TIME, atol=1e-6)


def test_a_dune_log_without_its_definition_is_refused_by_name_and_read_with_it(tmp_path):
    log = write_lsf(tmp_path / "Data.lsf", TIME, STATE)
    (tmp_path / "other").mkdir()
    (tmp_path / "IMC.xml").rename(tmp_path / "other" / "IMC.xml")
    with pytest.raises(LogError, match=r"IMC log \(DUNE, LSTS\), and the definition") as error:
        inspect_log(log)
    assert "--msg-path DIR" in error.value.hint
    assert inspect_log(log, msg_path=tmp_path / "other").run.has("yaw_rad")


@pytest.mark.parametrize(
    "text",
    [
        "<messages>",
        "<messages><message id='x' abbrev='A'/></messages>",
        "<!DOCTYPE a [<!ENTITY a 'b'>]><a/>",
        "<?xml version='1.0' encoding='UT-8'?><a/>",
    ],
)
def test_what_is_no_definition_is_said_so(tmp_path, text):
    log = write_lsf(tmp_path / "Data.lsf", TIME, STATE)
    (tmp_path / "IMC.xml").write_text(text)
    with pytest.raises(LogError, match="no definition of IMC messages"):
        inspect_log(log)


def test_damaged_messages_of_a_dune_log_are_left_out_and_counted(tmp_path):
    log = write_lsf(tmp_path / "Data.lsf", TIME, STATE)
    data = bytearray(log.read_bytes())
    whole = inspect_log(log)
    state = next(i for i in range(2000, len(data)) if data[i : i + 4] == b"\x54\xfe\x5e\x01")
    data[state + 30] ^= 0x40  # a number whose checksum is wrong then
    later = next(i for i in range(9000, len(data)) if data[i : i + 4] == b"\x54\xfe\x5e\x01")
    data[later + 4 : later + 6] = b"\xff\xff"  # a size that reaches beyond the end
    log.write_bytes(bytes(data[:-10]))
    found = inspect_log(log)
    (note,) = [n for n in found.notes if n.code == "truncated"]
    assert note.data["count"] == 3
    assert f"the first at byte {later}" in note.message
    counts = {c.name: c.count for c in found.inventory.channels}
    assert counts["EstimatedState"] == {c.name: c.count for c in whole.inventory.channels}["EstimatedState"] - 3


def test_what_another_system_said_is_no_state_of_the_vehicle_that_wrote_the_log(tmp_path):
    log = write_lsf(tmp_path / "Data.lsf", TIME, STATE)
    other = b"".join(imc_message(350, 1.7e9 + t, struct.pack("<4d", 0.7, 9.0, 0.0, 0.0), source=0x0802) for t in TIME[::3])
    log.write_bytes(log.read_bytes() + other)
    found = inspect_log(log)
    assert "EstimatedState[0x0802.40]" in {c.name for c in found.inventory.channels}
    np.testing.assert_allclose(found.run["yaw_rad"], YAW, atol=1e-12)


def test_a_matlab_7_3_file_is_read_by_its_library_and_names_it_where_it_is_missing(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py", reason="needs the extra `matlab`")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for name, values in (("time_s", TIME), ("yaw_rad", YAW), ("rudder_rad", np.sign(YAW))):
            file[name] = values[None, :]
        file["log/gain"] = np.array([[2.0]])
    with (tmp_path / "a.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49))
    run = load_run(tmp_path / "a.mat")
    np.testing.assert_array_equal(run["yaw_rad"], YAW)
    np.testing.assert_array_equal(run.time, TIME)
    monkeypatch.setattr("fieldsid.logs.readers._topics.import_module", _missing)
    with pytest.raises(LogError, match=r"a MATLAB 7\.3 file") as error:
        load_run(tmp_path / "a.mat")
    assert error.value.hint == "install it: `pip install 'fieldsid[matlab]'`"


def _missing(name):
    raise ImportError(f"No module named {name!r}")


@pytest.mark.parametrize(("place", "name"), [("cac", "0A0B0C0D.CAC"), ("../cac", "0a0b0c0d.cac"), ("cache", "0A0B0C0D.cac")])
def test_the_list_of_a_gliders_sensors_is_found_where_gliders_people_keep_it(tmp_path, place, name):
    log = write_dbd((tmp_path / "logs", (tmp_path / "logs").mkdir())[0] / "a.dbd", TIME, {"m_heading": YAW})
    raw = log.read_bytes()
    first, last = raw.index(b"s: T"), raw.index(b"sa\x34\x12")
    folder = log.parent / place
    folder.mkdir()
    (folder / name).write_bytes(raw[first:last])
    log.write_bytes(raw[:first].replace(b"factored:    0", b"factored:    1") + raw[last:])
    np.testing.assert_allclose(inspect_log(log).run["yaw_rad"], YAW, atol=1e-12)


def test_the_controls_of_px4_are_what_their_index_says_in_shares_of_their_range(tmp_path):
    pytest.importorskip("pyulog")
    controls = {f"{k}": 0.1 * k * np.sign(np.sin(0.5 * k * TIME + 0.1)) for k in range(4)}
    log = write_ulog(tmp_path / "log.ulg", TIME, controls, topic="actuator_controls_0", fields="double[4] control;")
    signals = inspect_log(log).proposal.body["signals"]
    assert {s: (item["field"], item.get("unit")) for s, item in signals.items()} == {
        "elevator_rad": ("control[1]", "1"),
        "rudder_rad": ("control[2]", "1"),
        "thrust": ("control[3]", None),
    }
