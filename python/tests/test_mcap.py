"""An MCAP file of a run, read with the format's own library."""

import csv
import json

import pytest

reader = pytest.importorskip("mcap.reader", reason="the package mcap is not installed")
from mcap.stream_reader import StreamReader  # noqa: E402


@pytest.fixture(scope="module")
def converted(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("mcap")
    program("simulate", "--set", "grid.min_cells=2000", "--out", str(folder / "run"))
    program("convert", str(folder / "run"), "--mcap", str(folder / "run.mcap"))
    return folder


def test_every_row_of_the_run_is_there(converted):
    with open(converted / "run/run.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    with open(converted / "run.mcap", "rb") as file:
        source = reader.make_reader(file, validate_crcs=True)
        summary = source.get_summary()
        assert summary.statistics.message_count == len(rows) * len(summary.channels)
        assert summary.chunk_indexes
        topics = {channel.topic for channel in summary.channels.values()}
        assert {"/temperature", "/power", "/absorption", "/state", "/time"} <= topics
        seen = 0
        for row, (schema, channel, message) in zip(rows, source.iter_messages(topics=["/temperature"])):
            values = json.loads(message.data)
            assert values["peak_true_K"] == float(row["peak_true_K"])
            assert message.log_time == round(float(row["time_s"]) * 1e9)
            assert channel.metadata["unit of peak_true_K"] == "K"
            assert schema.encoding == "jsonschema"
            assert set(values) <= set(json.loads(schema.data)["properties"])
            seen += 1
        assert seen == len(rows)


def test_metadata_and_every_crc(converted):
    with open(converted / "run.mcap", "rb") as file:
        assert [one.name for one in reader.make_reader(file).iter_metadata()] == ["run"]
    with open(converted / "run.mcap", "rb") as file:
        # Front to back, without the index; the reader raises where a CRC is wrong.
        assert sum(1 for _ in StreamReader(file, validate_crcs=True).records) > 250


def test_a_changed_byte_is_seen(converted):
    data = bytearray((converted / "run.mcap").read_bytes())
    at = data.find(b"peak_true_K\":", data.find(b"\x06", 4000) + 1)
    data[at + 14] ^= 1
    changed = converted / "changed.mcap"
    changed.write_bytes(data)
    with open(changed, "rb") as file, pytest.raises(Exception):
        list(reader.make_reader(file, validate_crcs=True).iter_messages())
