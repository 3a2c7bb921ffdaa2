"""`mrdamper cluster`: how to start a cluster for `mrdamper fleet`."""

from __future__ import annotations

import typer

_TEXT = """\
A cluster is a scheduler and any number of workers. Install the same version on every machine with
pip install 'mrdamper[fleet]'. All machines must reach the files under the same path.

1. One private network, or one machine (anybody who reaches the port can run code there):

   on one machine      dask scheduler --host {host} --port {port} --no-dashboard
   on every machine    dask worker tcp://{host}:{port} --nworkers auto --nthreads 1 --no-dashboard
   then                mrdamper fleet records/ --out line/ --scheduler tcp://{host}:{port}

2. Over a shared network: encrypted, for holders of your certificate only.

   once                openssl req -x509 -newkey rsa:3072 -nodes -days 365 -subj /CN=mrdamper-fleet \\
                         -addext "basicConstraints=critical,CA:TRUE" -keyout tls/key.pem -out tls/cert.pem
                       cp tls/cert.pem tls/ca.pem        # copy the folder tls/ to every machine; keep it secret
   on one machine      dask scheduler --host tls://{host} --port {port} --no-dashboard \\
                         --tls-ca-file tls/ca.pem --tls-cert tls/cert.pem --tls-key tls/key.pem
   on every machine    dask worker tls://{host}:{port} --nworkers auto --nthreads 1 --no-dashboard \\
                         --tls-ca-file tls/ca.pem --tls-cert tls/cert.pem --tls-key tls/key.pem
   then                mrdamper fleet records/ --out line/ --scheduler tls://{host}:{port} --tls tls/

The journal is written where mrdamper fleet runs, on a local disk. If a worker, the scheduler or the
command stops, run the same command again. On Slurm, PBS or Kubernetes, dask-jobqueue and dask-kubernetes start
the same scheduler and workers."""

app = typer.Typer()


@app.command(epilog="Example: mrdamper cluster --host 10.0.0.5")
def cluster(
    host: str = typer.Option("127.0.0.1", help="Address of the machine the scheduler will run on."),
    port: int = typer.Option(8786, min=1, max=65535, help="Its port."),
) -> None:
    """Show how to start a computing cluster for fleet."""
    print(_TEXT.format(host=host, port=port))
