"""proxy.py FILE - passes TCP connections of a free port of the loopback, which it prints, on to the one in the file.

Stopped by SIGSTOP it is a network that is cut: connections stand, and nothing comes through.
"""
import socket
import sys
import threading


def pump(source, sink):
    try:
        while data := source.recv(65536):
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
    for pair in ((near, far), (far, near)):
        threading.Thread(target=pump, args=pair, daemon=True).start()
