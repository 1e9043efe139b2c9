"""proxy.py FILE - passes TCP connections of a free port of the loopback, which it prints, on to the one in the file.

Stopped by SIGSTOP it is a network that is cut: connections stand, and nothing comes through. Where there is a file
FILE.damage, the last byte of the next answer to a request for contents of a task is changed, and that file removed.
"""
import os
import socket
import sys
import threading


def takes_damage():
    try:
        os.remove(sys.argv[1] + ".damage")
    except OSError:
        return False
    return True


def pump(source, sink, asked, forth):
    try:
        while data := source.recv(65536):
            if forth:
                asked[0] = b"/contents/" in data.split(b"\r\n")[0]
            elif asked[0] and not data.endswith(b"\r\n\r\n") and takes_damage():
                data = data[:-1] + bytes([data[-1] ^ 1])
            sink.sendall(data)
    except OSError:
        pass
    for end in (source, sink):
        try:
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


listener = socket.create_server(("127.0.0.1", 0))
print(listener.getsockname()[1], flush=True)
while True:
    near, _ = listener.accept()
    try:
        with open(sys.argv[1], encoding="ascii") as file:
            far = socket.create_connection(("127.0.0.1", int(file.read())))
    except (OSError, ValueError):
        near.close()
        continue
    asked_now = [False]  # whether the last request was for contents
    for ends in ((near, far, asked_now, True), (far, near, asked_now, False)):
        threading.Thread(target=pump, args=ends, daemon=True).start()
