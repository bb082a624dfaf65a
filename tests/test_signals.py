"""Files of measured channels: what is written is read back, and what cannot be right is refused by its place."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import synthetic_drop as drop
from typer.testing import CliRunner

import softbrake
from softbrake.case.units import STANDARD_GRAVITY
from softbrake.cli.app import app
from softbrake.core.arrays import Floats
from softbrake.report.test_files import CODES, RATE, channels_of
from softbrake.signals import Channel, SignalError, iso_mme, read_channels, uff
from softbrake.signals.iso_mme import CLASSES
from softbrake.studies.comparison import measured_curve

TABLE = np.array([[0.0, 1.5, -2.0], [0.1, 2.5e-3, 3.0], [0.25, -4.0, 1e6]])


def text(folder: Path, content: str | bytes, name: str = "test.csv") -> Path:
    """A file of a text."""
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def fault_of(folder: Path, content: str | bytes, **options: object) -> str:
    """What is said of a text, without the name of the file."""
    file = text(folder, content)
    with pytest.raises(SignalError) as caught:
        read_channels(file, **options)  # type: ignore[arg-type]
    assert str(caught.value).startswith(f"{file}:")
    return str(caught.value).removeprefix(f"{file}:").strip()


def rows(delimiter: str, comma: bool = False, ending: str = "\n") -> str:
    lines = ending.join(delimiter.join(repr(value) for value in row) for row in TABLE.tolist())
    return (lines.replace(".", ",") if comma else lines) + ending


def check(channels: list[Channel], table: np.ndarray = TABLE) -> None:
    """Acceleration in g and pressure in kPa over seconds."""
    assert [(each.name, each.unit, each.quantity) for each in channels] == [
        ("acc z", "g", "deceleration"),
        ("p", "kPa", "pressure"),
    ]
    for each, values, size in zip(channels, table.T[1:], (STANDARD_GRAVITY, 1e3), strict=True):
        np.testing.assert_array_equal(each.time, table[:, 0])
        np.testing.assert_array_equal(each.values, values * size)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
@pytest.mark.parametrize("comma", [False, True])
def test_delimiters_and_decimal_marks(tmp_path: Path, delimiter: str, comma: bool) -> None:
    header = delimiter.join(("time [s]", "acc z [g]", "p [kPa]")) + "\n"
    if delimiter == "," and comma:
        assert fault_of(tmp_path, header + rows(delimiter, comma)).startswith("1:1: 3 names above rows of 6 cells; ")
    else:
        check(read_channels(text(tmp_path, header + rows(delimiter, comma))))


@pytest.mark.parametrize(
    "header",
    [
        "time [s];acc z [g];p [kPa]",
        "time (s);acc z (g);p (kPa)",
        "time / s;acc z / g;p / kPa",
        '"time [s]";"acc z [g]";"p [kPa]"',
        "# time [s];acc z [g];p [kPa]",
        "Test 42;hall 2\nrate: 10 kHz\n\n% filtered\ntime [s];acc z [g];p [kPa]",
        "Test;42;7\ntime;acc z;p\ns;g;kPa",
        "time;acc z;p\n[s];[g];[kPa]",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_headers(tmp_path: Path, header: str, encoding: str, ending: str) -> None:
    content = (header + "\n").replace("\n", ending) + rows(";", ending=ending)
    check(read_channels(text(tmp_path, content.encode(encoding))))


def test_names_apart_by_single_spaces_keep_their_units(tmp_path: Path) -> None:
    check(read_channels(text(tmp_path, 'time [s] "acc z" (g) p [kPa]\n' + rows(" "))), TABLE)


def test_comments_blank_lines_quotes_and_a_delimiter_at_the_end_of_lines(tmp_path: Path) -> None:
    lines = [f'"{row}";'.replace(";", '";"', 2) for row in rows(";").splitlines()]
    lines[1:1] = ["", "# in between", "  // too"]
    check(read_channels(text(tmp_path, "time [s];acc z [g];p [kPa];\n" + "\n".join(lines))))


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("m/s^2", 1.0),
        ("m/s2", 1.0),
        ("m/s²", 1.0),
        ("m/s**2", 1.0),
        ("m/(s*s)", 1.0),
        ("mm/s^2", 1e-3),
        ("g_n", STANDARD_GRAVITY),
    ],
)
def test_spellings_of_an_acceleration(tmp_path: Path, unit: str, size: float) -> None:
    (channel,) = read_channels(text(tmp_path, f"t [ms];a [{unit}]\n0;1\n0.5;2\n"))
    assert (channel.quantity, channel.unit) == ("deceleration", unit)
    np.testing.assert_allclose(channel.values, [size, 2.0 * size], rtol=1e-15)
    np.testing.assert_allclose(channel.time, [0.0, 0.5e-3], rtol=1e-15)


def test_units_and_the_column_of_times_can_be_given(tmp_path: Path) -> None:
    file = text(tmp_path, "n,t,a [mV],left (front)\n1,0,1,2\n2,10,3,4\n")
    channels = read_channels(file, units={"t": "us", "a": "g"}, time="t")
    assert [(each.name, each.unit, each.quantity) for each in channels] == [
        ("n", "", None),
        ("a", "g", "deceleration"),
        ("left (front)", "", None),
    ]
    np.testing.assert_allclose(channels[1].time, [0.0, 1e-5], rtol=1e-15)
    assert channels[1].values.tolist() == [STANDARD_GRAVITY, 3.0 * STANDARD_GRAVITY]


def test_units_that_are_not_known_leave_values_as_they_are(tmp_path: Path) -> None:
    channels = read_channels(text(tmp_path, "t [s];T [°C];F [kN];U [mV]\n0;20;1;2\n1;21;3;4\n".encode("latin-1")))
    assert [(each.unit, each.quantity, each.values.tolist()) for each in channels] == [
        ("°C", None, [20.0, 21.0]),
        ("kN", None, [1e3, 3e3]),
        ("mV", None, [2.0, 4.0]),
    ]


HEAD = "t [s];a\n0,0;1\n"
CELL = "a number in each cell is expected"


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (HEAD + "0,1;\n", f"3:5: 'a': no value; {CELL}"),
        (HEAD + "0,1;NaN\n", f"3:5: 'a': no value, 'NaN'; {CELL}"),
        ("t [s];a\n0,0;\n0,1;1\n", f"2:5: 'a': no value; {CELL}"),
        (HEAD + "0,1;inf\n", f"3:5: 'a': no value, 'inf'; {CELL}"),
        (HEAD + "0,1;1e999\n", "3:5: 'a': 1e999 is not finite; a finite number is expected"),
        (HEAD + "0,1;1_0\n", "3:5: 'a': '1_0' is no number; one as 1.5e-3 is expected"),
        (
            HEAD + "0,1;2.5\n",
            "3:5: 'a': '2.5' has a point, others have commas; one decimal mark and none of thousands is expected",
        ),
        (HEAD + "0,1\n", "3:1: a row of 1, 2 in the header; a number below each name is expected"),
        (HEAD + "0,1;1;2\n", "3:1: a row of 3, 2 in the header; a number below each name is expected"),
        (HEAD + "0,0;2\n", "3:1: time 0,0 is not after 0,0 of the row before; times that rise are expected"),
        (HEAD + "-1;2\n", "3:1: time -1 is not after 0,0 of the row before; times that rise are expected"),
        (HEAD, "2:1: one row of numbers; two at least are expected"),
        (
            "t [s];a\n0;1,234\n1;2\n2;12,345\n",
            "2:4: each comma may mark decimals or thousands; "
            "numbers without a mark of thousands, or one comma with other than three digits behind it, are expected",
        ),
        ("t;a\n0;1\n1;2\n", "1:1: times 't': no unit; 't [s]', 't [ms]' or a unit given for it is expected"),
        ("t [m];a\n0;1\n1;2\n", "1:1: times 't': 'm' is a length; 't [s]', 't [ms]' or a unit given for it is expected"),
        ("t [s];a;a [g]\n0;1;2\n1;2;3\n", "1:9: a second column 'a'; names that differ are expected"),
        (",a\n0,1\n1,2\n", "1:1: column 1 has no name; a name for each column is expected"),
        ("0,1\n1,2\n", "1:1: no header; a line with a name for each column is expected, as 'time [s]', above the numbers"),
        (
            "t [s]\n12:30;1\n",
            "no row of numbers; below a header a time and a value at least in each line are expected, "
            "apart by tabs, semicolons, commas or spaces",
        ),
        (b"t [s];a\0\n", "is no text; columns of numbers, or a file *.mme, *.uff, *.tdms are expected"),
    ],
)
def test_faults_of_a_text(tmp_path: Path, content: str | bytes, fault: str) -> None:
    assert fault_of(tmp_path, content) == fault


def test_a_few_commas_that_are_no_marks_of_thousands_settle_all(tmp_path: Path) -> None:
    (channel,) = read_channels(text(tmp_path, "t [s];a\n0,001;1,234\n1,002;12,345\n"))
    assert channel.values.tolist() == [1.234, 12.345]


def test_faults_of_what_is_asked_for(tmp_path: Path) -> None:
    content = "t [s];a\n0;1\n1;2\n"
    assert fault_of(tmp_path, content, time="b") == "no column 'b' for the times; 't', 'a' are expected"
    assert fault_of(tmp_path, content, units={"b": "g"}) == "no channel 'b' to give a unit; 't', 'a' are expected"
    told = "channel 'a': 'gg' is no unit; one as 'g', 'm/s^2' or 'kPa' is expected"
    assert fault_of(tmp_path, content, units={"a": "gg"}) == told
    with pytest.raises(SignalError, match="none.csv: cannot be read: No such file or directory"):
        read_channels(tmp_path / "none.csv")


def test_random_tables_of_any_form_are_read_to_the_last_digit(tmp_path: Path) -> None:
    random = np.random.default_rng(20)
    for _ in range(40):
        count, columns = random.integers(2, 40), random.integers(2, 6)
        values = random.normal(size=(count, columns)) * 10.0 ** random.integers(-12, 12, (count, columns))
        values[:, 0] = np.sort(random.normal(size=count))
        delimiter = random.choice([",", ";", "\t", " "])
        comma, quoted = delimiter != "," and random.random() < 0.5, random.random() < 0.3
        lines = [f"c{k} [s]" if k == 0 else f"c{k}" for k in range(columns)], *[list(map(repr, row)) for row in values.tolist()]
        body = "\n".join(delimiter.join(f'"{cell}"' if quoted else cell for cell in line) for line in lines)
        channels = read_channels(text(tmp_path, body.replace(".", ",") if comma else body))
        np.testing.assert_array_equal(channels[0].time, values[:, 0])
        np.testing.assert_array_equal(np.transpose([each.values for each in channels]), values[:, 1:])


def spoilt(content: str, random: np.random.Generator) -> str:
    """A text with a few characters lost, doubled or replaced."""
    for _ in range(random.integers(1, 4)):
        at, some = random.integers(len(content)), random.integers(1, 9)
        new = random.choice([*'0123456789.,;- \n\t"[]()eE+#/%:_ns', content[at : at + some] * 2, ""])
        content = content[:at] + new + content[at + (1 if len(new) < 2 else some) :]
    return content


def test_of_a_spoilt_file_all_is_a_number_or_it_is_refused(tmp_path: Path) -> None:
    random = np.random.default_rng(21)
    table = 'Test;4\n# c\ntime [s];"a b" [g];p / kPa\n0,1;1;2,5\n0,2;-1e-3;"2,5"\n0,3;1;2,5\n'
    whole = iso_mme.files("t", "", [channel(random.normal(size=5), name, time=EVEN[:5]) for name in "ab"], 1e-4)
    answers = {"read": 0, "refused": 0}
    for _ in range(400):
        hit = random.choice(list(whole))
        texts = {name: spoilt(content, random) if name == hit else content for name, content in whole.items()}
        for file in (text(tmp_path, spoilt(table, random)), write_iso_mme(tmp_path / "iso", texts)):
            try:
                channels = read_channels(file)
            except SignalError as error:
                answers["refused"] += 1
                assert str(error).startswith(str(file)) and "\n" not in str(error) and "; " in str(error)
                continue
            answers["read"] += 1
            for each in channels:
                assert len(each.time) == len(each.values) and (np.diff(each.time) > 0.0).all() and np.isfinite(each.time).all()
                assert each.fault is not None or np.isfinite(each.values).all()
    assert min(answers.values()) > 100


def test_exported_curves_are_read_back_exactly(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    assert CliRunner().invoke(app, ["export", str(tmp_path / "drop.vtkhdf"), "--format", "csv"]).exit_code == 0
    result = softbrake.read_result(tmp_path / "drop.vtkhdf")
    channels = read_channels(tmp_path / "drop.csv")
    assert {each.name: each.unit for each in channels} | {"time": "s"} == result.units
    for each in channels:
        np.testing.assert_array_equal(each.time, result.history["time"])
        np.testing.assert_array_equal(each.values, result.history[each.name])


EVEN = 5e-5 + 1e-4 * np.arange(50)


def channel(values: Floats, name: str = "acceleration", unit: str = "m/s^2", time: Floats = EVEN) -> Channel:
    """A channel of a made test."""
    return Channel(name, time, values, unit, "T0PLAF000000AC30")


def random_channels(seed: int) -> list[Channel]:
    """Numbers of any size, and the quantities of a test."""
    random = np.random.default_rng(seed)
    units = {
        "acceleration": "m/s^2",
        "pressure": "Pa",
        "velocity": "m/s",
        "height": "m",
        "tension_hoop": "N/m",
        "ground_area": "m^2",
    }
    size = 10.0 ** random.integers(-200, 200, (len(units), len(EVEN)))
    return [channel(random.normal(size=len(EVEN)) * size[k], name, unit) for k, (name, unit) in enumerate(units.items())]


def assert_equal(read: list[Channel], written: list[Channel]) -> None:
    """Names, units, times and values to the last digit."""
    assert [(each.name, each.unit) for each in read] == [(each.name, each.unit) for each in written]
    for one, other in zip(read, written, strict=True):
        np.testing.assert_array_equal(one.time, other.time)
        np.testing.assert_array_equal(one.values, other.values)


def write_iso_mme(folder: Path, texts: dict[str, str]) -> Path:
    """A test of ISO-MME."""
    for name, content in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")
    return folder


@pytest.mark.parametrize("seed", range(5))
def test_iso_mme_reads_back_exactly(tmp_path: Path, seed: int) -> None:
    channels = random_channels(seed)
    folder = write_iso_mme(tmp_path / "test", iso_mme.files("drop", "A drop", channels, 1e-4))
    assert_equal(read_channels(folder), channels)
    assert_equal(read_channels(folder / "drop.mme"), channels)
    assert_equal(read_channels(folder / "Channel" / "drop.chn"), channels)
    assert_equal(read_channels(folder / "Channel" / "drop.002"), channels[1:2])
    assert [each.code for each in read_channels(folder)] == [each.code for each in channels]


PYISOMME = Path(__file__).parent / "iso_mme"  # written by pyisomme 1.1.0, see benchmarks/iso_mme.py


def test_a_test_of_pyisomme_is_read() -> None:
    even = -1e-4 + 1e-4 * np.arange(6)
    acceleration, pressure, velocity = read_channels(PYISOMME)
    assert (acceleration.name, acceleration.quantity, acceleration.cfc) == ("acc z", "deceleration", 1000)
    assert (pressure.name, pressure.quantity, pressure.cfc) == ("p", "pressure", 180)
    assert (velocity.name, velocity.quantity, velocity.cfc) == ("v", "velocity", None)
    np.testing.assert_array_equal(acceleration.time, even)
    np.testing.assert_array_equal(acceleration.values, [0.0, 1.5, -2.25, 3.0, 4.0, 5.0])
    np.testing.assert_array_equal(pressure.values, [500.0, 1500.0, 2500.0, 3000.0, 4000.0, 5000.0])
    np.testing.assert_allclose(velocity.time, np.array([0.0, 0.1, 0.3, 0.4, 0.5, 0.7]) * 1e-3, rtol=1e-15)
    np.testing.assert_allclose(velocity.values, [-6.0, -5.0, -4.0, -3.0, -2.0, -1.0], rtol=1e-15)


CFC = {"A": 1000, "B": 600, "C": 180, "D": 60, "E": 1000, "F": 600, "G": 180, "H": 60, "L": 20}


@pytest.mark.parametrize(("letter", "cfc"), [*CFC.items(), *((each, None) for each in "0PQSVX?")])
def test_the_last_character_of_a_code_is_the_class(tmp_path: Path, letter: str, cfc: int | None) -> None:
    made = Channel("a", EVEN, np.zeros(len(EVEN)), "m/s^2", f"T0PLAF000000AC3{letter}")
    (found,) = read_channels(write_iso_mme(tmp_path, iso_mme.files("t", "", [made], 1e-4)))
    assert found.cfc == cfc and (letter in CLASSES) == (cfc is not None)


def iso_mme_fault(folder: Path, changes: dict[str, dict[str, str]], **options: Any) -> str:
    """What is said of a test of one channel of three samples, and one of times, with parts of its files replaced."""
    made = [
        channel(np.array([1.0, 2.0, 3.0]), "a", time=EVEN[:3]),
        channel(np.array([0.0, 1.0, 2.5]), "clock", "ms", time=EVEN[:3]),
    ]
    texts = iso_mme.files("t", "", made, 1e-4)
    for name, change in changes.items():
        for old, new in change.items():
            assert old in texts[name]
            texts[name] = texts[name].replace(old, new)
    write_iso_mme(folder, texts)
    with pytest.raises(SignalError) as caught:
        read_channels(folder, **options)
    return str(caught.value).replace(f"{folder}/", "")


A, CLOCK, LIST = "Channel/t.001", "Channel/t.002", "Channel/t.chn"
OF_CLOCK = {"implicit\n": "explicit\nReference channel name      :clock\n"}


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({A: {"2.0\n": "two\n"}}, f"{A}:9:1: 'a': 'two' is no number; a sample is expected"),
        ({A: {"3.0\n": ""}}, f"{A}: 'a': 2 samples, 3 in 'Number of samples'; as many are expected"),
        (
            {A: {"Time of first sample        :5e-05\n": ""}},
            f"{A}: 'a': no 'Time of first sample'; a number of seconds is expected",
        ),
        (
            {A: {"Sampling interval           :0.0001": "Sampling interval           :NOVALUE"}},
            f"{A}: 'a': no 'Sampling interval'; a number of seconds is expected",
        ),
        (
            {A: {"Sampling interval           :0.0001": "Sampling interval           :0"}},
            f"{A}: 'a': 'Sampling interval' is 0 s from 5e-05 s on; times that rise are expected",
        ),
        (
            {A: {"implicit": "explicit"}},
            f"{A}: 'a': its times are not said; "
            "'Reference channel' implicit, or explicit with the code of one channel in 'Reference channel name', is expected",
        ),
        (
            {A: {"implicit\n": "explicit\nReference channel name      :clocks\n"}},
            f"{A}: 'a': its times are channel 'clocks', of which there are 0; "
            "'Reference channel' implicit, or explicit with the code of one channel in 'Reference channel name', is expected",
        ),
        (
            {A: OF_CLOCK, CLOCK: {"2.5\n": "1.0\n"}},
            f"{CLOCK}:10:1: 'clock': time 1.0 is not after 1.0 of the sample before; times that rise are expected",
        ),
        (
            {A: OF_CLOCK, CLOCK: {"2.5\n": "NOVALUE\n"}},
            f"{CLOCK}:10:1: 'clock': sample 3 is NOVALUE; a number at each sample is expected",
        ),
        (
            {A: OF_CLOCK, CLOCK: {"2.5\n": "", "samples           :3": "samples           :2"}},
            f"{A}: 'a': 3 samples at 2 times of 'clock'; as many are expected",
        ),
        ({A: OF_CLOCK, CLOCK: {":ms": ":m"}}, f"{CLOCK}: 'clock': 'm' is a length; a unit of time is expected"),
        ({LIST: {"channel 002": "channel 003"}}, f"{LIST}: lists channel 003; a file t.003 beside it is expected"),
        ({LIST: {"Name of channel": "Channel"}}, f"{LIST}: lists no channel; 'Name of channel 001' is expected"),
    ],
)
def test_faults_of_iso_mme(tmp_path: Path, changes: dict[str, dict[str, str]], fault: str) -> None:
    assert iso_mme_fault(tmp_path, changes) == fault


def test_faults_of_a_folder_and_of_options(tmp_path: Path) -> None:
    assert iso_mme_fault(tmp_path, {}, time="clock").endswith("say their times themselves; no channel of times is expected")
    assert iso_mme_fault(tmp_path, {}, units={"b": "g"}).startswith(f"{tmp_path}: no channel 'b' to give a unit; 'a', ")
    (tmp_path / LIST).unlink()
    expected = "a test of ISO-MME is expected: TEST.mme, and Channel/ beside it with TEST.chn, TEST.001 ..."
    with pytest.raises(SignalError) as caught:
        read_channels(tmp_path)
    assert str(caught.value) == f"{tmp_path / 't.mme'}: no Channel/t.chn beside it; {expected}"
    (tmp_path / "t.mme").unlink()
    with pytest.raises(SignalError) as caught:
        read_channels(tmp_path)
    assert str(caught.value) == f"{tmp_path}: no files *.mme in {tmp_path}; {expected}"


def test_a_sample_of_no_value_forbids_its_channel_and_no_other(tmp_path: Path) -> None:
    texts = iso_mme.files("t", "", [channel(np.array([1.0, 2.0, 3.0]), name, time=EVEN[:3]) for name in "ab"], 1e-4)
    texts[A] = texts[A].replace("\n2.0\n", "\nNOVALUE\n")
    first, second = read_channels(write_iso_mme(tmp_path, texts))
    assert first.fault == f"{tmp_path / A}:9:1: 'a': sample 2 is NOVALUE; a number at each sample is expected"
    assert np.isnan(first.values).tolist() == [False, True, False]
    assert second.fault is None and second.values.tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match="'a': sample 2 is NOVALUE"):
        measured_curve(first, None)


def written_by_pyuff(file: Path, values: Floats, time: Floats = EVEN, **fields: Any) -> Path:
    """A dataset 58 of a time response, as pyuff writes it."""
    pyuff = pytest.importorskip("pyuff")
    node = {"rsp_node": 12, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0, "orddenom_spec_data_type": 0}
    axes = {"abscissa_spacing": 1, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12, "x": time, "data": values}
    pyuff.UFF(str(file)).write_sets({"type": 58, "func_type": 1, **node, **axes, **fields}, "add")
    return file


@pytest.mark.parametrize("seed", range(5))
def test_uff_reads_back_exactly(tmp_path: Path, seed: int) -> None:
    pyuff = pytest.importorskip("pyuff")
    channels = random_channels(seed)
    uff.write(tmp_path / "drop.uff", "A drop", channels)
    assert_equal(read_channels(tmp_path / "drop.uff"), channels)
    units, *sets = pyuff.UFF(str(tmp_path / "drop.uff")).read_sets()
    assert (units["type"], units["units_code"]) == (164, 1)
    for each, made in zip(sets, channels, strict=True):
        np.testing.assert_array_equal(each["x"], made.time)
        np.testing.assert_array_equal(each["data"], made.values)
    exponents = {
        each["id1"]: (each["ordinate_spec_data_type"], each["ordinate_len_unit_exp"], each["ordinate_force_unit_exp"])
        for each in sets
    }
    assert (
        exponents["tension_hoop"] == (1, -1, 1) and exponents["ground_area"] == (1, 2, 0) and exponents["pressure"] == (15, 0, 0)
    )


def test_uff_in_text_has_twelve_digits(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=len(EVEN)) * 1e3
    file = written_by_pyuff(tmp_path / "a.uff", values, id1="acc z", ordinate_axis_units_lab="g")
    (found,) = read_channels(file)
    assert (found.name, found.unit, found.quantity) == ("acc z", "g", "deceleration")
    np.testing.assert_array_equal(found.time, EVEN)
    np.testing.assert_allclose(found.values, values * STANDARD_GRAVITY, rtol=5.1e-12)
    assert (found.values != values * STANDARD_GRAVITY).any()


def test_names_and_units_of_uff(tmp_path: Path) -> None:
    file, values = tmp_path / "a.uff", np.arange(50.0)
    pytest.importorskip("pyuff").UFF(str(file)).write_sets(
        {
            "type": 164,
            "units_code": 1,
            "units_description": "SI",
            "temp_mode": 1,
            "length": 1,
            "force": 1,
            "temp": 1,
            "temp_offset": 0,
        }
    )
    written_by_pyuff(file, values)
    written_by_pyuff(file, values, ordinate_spec_data_type=15, rsp_dir=0)
    written_by_pyuff(file, values, ordinate_spec_data_type=0, abscissa_axis_units_lab="ms", id1="the only")
    written_by_pyuff(file, values, func_type=4, abscissa_spec_data_type=18)  # over frequency
    written_by_pyuff(file, values)
    channels = read_channels(file, units={"the only": "kPa"})
    assert [(each.name, each.unit, each.quantity) for each in channels] == [
        ("12+Z", "m/s^2", "deceleration"),
        ("12", "Pa", "pressure"),
        ("the only", "kPa", "pressure"),
        ("12+Z (6)", "m/s^2", "deceleration"),
    ]
    np.testing.assert_allclose(channels[2].time, EVEN * 1e-3, rtol=1e-15)


def test_without_units_uff_says_none(tmp_path: Path) -> None:
    (found,) = read_channels(written_by_pyuff(tmp_path / "a.uff", np.arange(50.0)))
    assert (found.unit, found.quantity) == ("", None)


def refused(file: Path, **options: Any) -> str:
    """What is said of a file, without its name."""
    with pytest.raises(SignalError) as caught:
        read_channels(file, **options)
    return str(caught.value).removeprefix(f"{file}: ")


def test_uneven_times_of_uff(tmp_path: Path) -> None:
    """In text they have six digits; in binary datasets of pyuff all."""
    uneven = np.cumsum(1e-4 + 1e-5 * np.random.default_rng(2).random(50))
    (text_,) = read_channels(written_by_pyuff(tmp_path / "text.uff", np.arange(50.0), uneven, abscissa_spacing=0))
    (binary,) = read_channels(written_by_pyuff(tmp_path / "binary.uff", np.arange(50.0), uneven, abscissa_spacing=0, binary=1))
    np.testing.assert_array_equal(binary.time, uneven)
    np.testing.assert_allclose(text_.time, uneven, rtol=5.1e-6)
    assert (text_.time != uneven).any()
    few = written_by_pyuff(tmp_path / "few.uff", np.arange(50.0), 10.0 + 2e-4 * np.arange(50), abscissa_spacing=0)
    expected = "10 units of the last digit, even times or a binary dataset are expected"
    assert refused(few) == f"dataset 1, '12+Z': times 10 and 10.0002 are 0.0002 apart and have 6 digits; {expected}"
    none = written_by_pyuff(tmp_path / "none.uff", np.arange(50.0), 10.0 + 4e-5 * np.arange(50), abscissa_spacing=0)
    assert refused(none) == "dataset 1, '12+Z': time 10 of sample 2 is not after 10; times that rise are expected"


def test_faults_of_uff(tmp_path: Path) -> None:
    file = written_by_pyuff(tmp_path / "a.uff", np.arange(50.0), id1="a")
    whole = file.read_text()
    assert refused(file, time="t") == "datasets 58 have times of their own; no channel of times is expected"
    lines = whole.splitlines(keepends=True)
    file.write_text("".join([*lines[:-2], lines[-1]]))
    assert refused(file) == "dataset 1, 'a': 48 samples, 50 in its header; as many, two at least, are expected"
    file.write_text("".join(lines[:-1]))
    assert refused(file) == "ends within a dataset, or is no UFF; a line '    -1' at the end is expected"
    file.write_text(whole.replace("4.90000000000e+01", "4.9e+01 and more  "))
    assert refused(file) == "dataset 1: pyuff cannot read it; one of type 58 by its format is expected"
    file.write_text(whole.replace(" 4.90000000000e+01", "               nan"))
    (found,) = read_channels(file)
    assert found.fault == f"{file}: dataset 1, 'a': sample 50 is nan; a number at each sample is expected"
    spectrum = written_by_pyuff(tmp_path / "b.uff", np.arange(50.0), func_type=4, abscissa_spec_data_type=18)
    assert refused(spectrum) == "no function over time; a dataset 58 of type 1, time response, is expected"
    complex_ = written_by_pyuff(tmp_path / "c.uff", np.arange(50) * 1j, id1="c")
    assert refused(complex_) == "dataset 1, 'c': samples are complex; real ones are expected"


def test_what_uff_cannot_hold_is_not_written(tmp_path: Path) -> None:
    pytest.importorskip("pyuff")
    values = np.arange(50.0)
    with pytest.raises(SignalError, match="'acceleration': samples that are no numbers; pyuff would write 0.0"):
        uff.write(tmp_path / "a.uff", "", [channel(np.where(values == 3.0, np.nan, values))])
    with pytest.raises(SignalError, match="'acceleration': its times need more than 6 digits; fewer are expected"):
        uff.write(tmp_path / "a.uff", "", [channel(values, time=np.arange(50.0) / 3000.0)])


def tdms(file: Path, *channels: tuple[str, Any, dict[str, Any]], group: str = "drop") -> Path:
    """A file as the writer of npTDMS makes it."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(file)) as writer:
        writer.write_segment([nptdms.ChannelObject(group, name, values, properties) for name, values, properties in channels])
    return file


@pytest.mark.parametrize("unit", ["unit_string", "NI_UnitDescription"])
def test_tdms_is_read_exactly(tmp_path: Path, unit: str) -> None:
    random = np.random.default_rng(5)
    values, single = random.normal(size=50), random.normal(size=40).astype(np.float32)
    wave = {"wf_increment": 1e-4, "wf_start_offset": 5e-5, unit: "g"}
    file = tdms(
        tmp_path / "a.tdms",
        ("acc z", values, wave),
        ("p", single, {"wf_increment": 1e-3, unit: "kPa"}),
        ("note", ["begin", "end"], {}),
    )
    acceleration, pressure = read_channels(file)
    assert (acceleration.name, acceleration.unit, acceleration.quantity) == ("acc z", "g", "deceleration")
    np.testing.assert_array_equal(acceleration.time, EVEN)
    np.testing.assert_array_equal(acceleration.values, values * STANDARD_GRAVITY)
    np.testing.assert_array_equal(pressure.time, 1e-3 * np.arange(40))
    np.testing.assert_array_equal(pressure.values, single.astype(float) * 1e3)


def test_tdms_with_a_channel_of_times(tmp_path: Path) -> None:
    times = np.cumsum(np.random.default_rng(6).random(50))
    file = tdms(tmp_path / "a.tdms", ("t", times, {"unit_string": "ms"}), ("a", np.arange(50), {"unit_string": "m/s^2"}))
    told = "'t': no wf_increment; an increment, or the name of a channel of times, is expected"
    assert refused(file) == told
    (found,) = read_channels(file, time="t")
    np.testing.assert_array_equal(found.time, times * 1e-3)
    np.testing.assert_array_equal(found.values, np.arange(50.0))


@pytest.mark.parametrize(
    ("channels", "options", "fault"),
    [
        (
            [("a", [1.0, 2.0], {"wf_increment": 0.0})],
            {},
            "'a': wf_increment is 0 s from 0 s on; times that rise are expected",
        ),
        ([("a", [1.0, 2.0], {})], {"time": "t"}, "no channel 't' for the times; 'a' are expected"),
        (
            [("a", [1.0, 2.0], {}), ("t", [0.0, 1.0], {})],
            {"time": "t"},
            "'t': no unit; a unit of time in unit_string, or given for it",
        ),
        (
            [("a", [1.0, 2.0], {}), ("t", [0.0, 0.0], {})],
            {"time": "t"},
            "'t': time 0 of sample 2 is not after 0; times that rise are",
        ),
        ([("a", [1.0, 2.0], {}), ("t", [0.0, np.nan], {})], {"time": "t"}, "'t': a time is no number; a time at each sample is"),
        (
            [("a", [1.0, 2.0], {}), ("t", [0.0, 1.0, 2.0], {"unit_string": "s"})],
            {"time": "t"},
            "'a': 2 samples at 3 times of 't'; as many are expected",
        ),
        ([("note", ["one", "two"], {})], {}, "no channel of numbers; one at least is expected"),
    ],
)
def test_faults_of_tdms(tmp_path: Path, channels: list[Any], options: dict[str, str], fault: str) -> None:
    assert refused(tdms(tmp_path / "a.tdms", *channels), **options).startswith(fault)


def test_a_channel_of_tdms_without_numbers_is_marked(tmp_path: Path) -> None:
    wave = {"wf_increment": 1e-4}
    first, second = read_channels(tdms(tmp_path / "a.tdms", ("a", [1.0, np.nan], wave), ("b", [1.0], wave)))
    assert first.fault == f"{tmp_path / 'a.tdms'}: 'a': sample 2 is nan; a number at each sample is expected"
    assert second.fault == f"{tmp_path / 'a.tdms'}: 'b': 1 samples; two at least are expected"


def test_a_tdms_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    file = tdms(tmp_path / "a.tdms", ("a", np.arange(50.0), {"wf_increment": 1e-4}))
    file.write_bytes(file.read_bytes()[:-16])
    assert refused(file) == "ends within a segment, so samples are missing; a whole file is expected"


def test_what_is_no_tdms_is_said(tmp_path: Path) -> None:
    pytest.importorskip("nptdms")
    file = text(tmp_path, "t,a\n0,1\n" * 10, "a.tdms")
    assert refused(file).startswith("npTDMS cannot read it: ") and refused(file).endswith("; a file of TDMS is expected")


@pytest.mark.parametrize(
    ("ending", "module", "name"), [("uff", "pyuff", "UFF needs pyuff"), ("tdms", "nptdms", "TDMS needs npTDMS")]
)
def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, module: str, name: str) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert refused(text(tmp_path, "", f"a.{ending}")) == f"{name}: pip install 'softbrake[test-data]'"


@pytest.mark.parametrize(("form", "file"), [("iso-mme", "drop-iso-mme"), ("uff", "drop.uff")])
def test_an_exported_drop_is_read_back_exactly(tmp_path: Path, form: str, file: str) -> None:
    drop.write(tmp_path / "drop.vtkhdf", replace(drop.case(4, 8), title="Two lines:\nHöhe 5 m"))
    done = CliRunner().invoke(app, ["export", str(tmp_path / "drop.vtkhdf"), "--format", form])
    assert (done.exit_code, done.output) == (0, f"{tmp_path / file} written\n")
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted(["drop.vtkhdf", file])
    channels = channels_of(softbrake.read_result(tmp_path / "drop.vtkhdf"))
    assert_equal(read_channels(tmp_path / file), channels)
    again = CliRunner().invoke(app, ["export", str(tmp_path / "drop.vtkhdf"), "--format", form])
    if form == "iso-mme":
        assert (again.exit_code, again.stderr) == (2, f"{tmp_path / file}: is there already; --output must name a new folder\n")
    else:
        assert again.exit_code == 0
        assert_equal(read_channels(tmp_path / file), channels)


def test_an_exported_drop_keeps_its_momentum_and_its_means(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    history = softbrake.read_result(tmp_path / "drop.vtkhdf").history
    found = {each.name: each for each in channels_of(softbrake.read_result(tmp_path / "drop.vtkhdf"))}
    time = found["height"].time
    assert (len(time), time[0]) == (int(drop.END * RATE), 0.5 / RATE)
    np.testing.assert_allclose(np.diff(time), 1.0 / RATE, rtol=1e-9)
    height, velocity = drop.cargo(time)  # type: ignore[arg-type]
    np.testing.assert_allclose(found["velocity"].values, velocity, rtol=1e-9)
    np.testing.assert_allclose(found["height"].values, height, atol=0.125 * drop.DECELERATION * (drop.END / 499) ** 2)
    np.testing.assert_allclose(found["acceleration"].values, drop.DECELERATION, rtol=1e-9)
    gained = history["velocity"][-1] - history["velocity"][0]
    assert found["acceleration"].values.sum() / RATE == pytest.approx(gained, rel=1e-9)
    impulse = np.trapezoid(history["tension_hoop"], history["time"])
    assert found["tension_hoop"].values.sum() / RATE == pytest.approx(impulse, rel=1e-9)
    assert found["pressure"].values == pytest.approx(drop.PRESSURE, rel=1e-9)


def test_codes_are_unique_and_of_sixteen_characters() -> None:
    assert len(set(CODES.values())) == len(CODES)
    assert all(len(code) == 16 and code.isalnum() for code in CODES.values())


def test_mistakes_of_exports_of_test_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    drop.write(Path("drop.vtkhdf"), drop.case(4, 8))
    for words, message in (
        (["--format", "uff", "-o", "drop.dat"], "drop.dat: the name ends in .uff\n"),
        (["--format", "iso-mme", "-o", "no/drop"], "no/drop: there is no folder no\n"),
    ):
        done = CliRunner().invoke(app, ["export", "drop.vtkhdf", *words])
        assert (done.exit_code, done.stderr) == (2, message)
    monkeypatch.setitem(sys.modules, "pyuff", None)
    done = CliRunner().invoke(app, ["export", "drop.vtkhdf", "--format", "uff"])
    assert done.exit_code == 2 and done.stderr.endswith("UFF needs pyuff: pip install 'softbrake[test-data]'\n")
    assert [each.name for each in tmp_path.iterdir()] == ["drop.vtkhdf"]
