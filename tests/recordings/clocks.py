"""Writes clocks.mcap: the bag bag_mcap with the stamps of its wrist sensor counted from the power-on of the sensor.

The log times are those of the bag, so that the force along x is 10 t by the clock of the recorder. Needs the package mcap.
"""

import struct
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer

HERE = Path(__file__).parent
POWER_ON = 1_699_999_995  # s

with open(HERE / "bag_mcap" / "bag_mcap.mcap", "rb") as bag, open(HERE / "clocks.mcap", "wb") as out:
    writer = Writer(out)
    writer.start()
    schemas, channels = {}, {}
    for schema, channel, message in make_reader(bag).iter_messages():
        if schema.id not in schemas:
            schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
        if channel.id not in channels:
            of = schemas[schema.id]
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, of)
        data = bytearray(message.data)
        if channel.topic == "/ft_sensor/wrench":
            # Four bytes of CDR, then the stamp.
            seconds, nanoseconds = struct.unpack("<iI", data[4:12])
            data[4:12] = struct.pack("<iI", seconds - POWER_ON, nanoseconds)
        writer.add_message(channels[channel.id], message.log_time, bytes(data), message.publish_time)
    writer.finish()
