#!/usr/bin/env python3
"""How a fieldbus stack hands its process image to safepair: one call in each bus cycle.

    process_image.py 127.0.0.1:34980 0 11 0 27 < cycles.txt

Arguments: gateway, offset and length of the frame in the outputs (master to device), offset and
length in the inputs (device to master). Standard input stands in for the stack: one output image a
line, hexadecimal, a line a bus cycle; standard output shows the input image after each.
"""

import socket
import sys


class Device:
    """A safety device in the process image of a fieldbus."""

    def __init__(self, gateway, outputs, inputs):
        host, port = gateway.rsplit(":", 1)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect((host, int(port)))
        # A stack with a cycle of its own does not wait.
        self.socket.settimeout(0.1)
        self.outputs, self.inputs, self.last = outputs, inputs, None

    def cycle(self, outputs, inputs):
        """Carries the frame of one bus cycle, as it is: a new one there, an answer back."""
        frame = bytes(outputs[self.outputs])
        if frame != self.last:
            self.socket.send(frame)
            self.last = frame
        try:
            answer = self.socket.recv(300)
        except TimeoutError:
            return
        # Another length is no frame of this device.
        if len(answer) == self.inputs.stop - self.inputs.start:
            inputs[self.inputs] = answer


def main():
    if len(sys.argv) != 6:
        print(__doc__, file=sys.stderr)
        return 2
    out_at, out_length, in_at, in_length = map(int, sys.argv[2:])
    device = Device(sys.argv[1], slice(out_at, out_at + out_length), slice(in_at, in_at + in_length))
    image = bytearray(in_at + in_length)
    for line in sys.stdin:
        device.cycle(bytes.fromhex(line.strip()), image)
        print(image.hex(), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
