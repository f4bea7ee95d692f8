"""Generates certificates for tests, with openssl."""

import subprocess

from processes import DEADLINE_S


class Certificates:
    """A root certificate and certificates that it signs, as NAME.pem and NAME.key in `folder`."""

    def __init__(self, folder, root="root"):
        self.folder = folder
        self.root = root
        self._make(root)

    def _make(self, name, *more):
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
             "-noenc", "-days", "1", "-subj", f"/CN={name}", "-keyout", f"{name}.key",
             "-out", f"{name}.pem", *more],
            cwd=self.folder, check=True, capture_output=True, timeout=DEADLINE_S)

    def sign(self, name, names="DNS:localhost,IP:127.0.0.1"):
        """Makes a certificate with these subject alternative names."""
        self._make(name, "-CA", f"{self.root}.pem", "-CAkey", f"{self.root}.key",
                   "-addext", f"subjectAltName={names}",
                   "-addext", "basicConstraints=critical,CA:FALSE")
