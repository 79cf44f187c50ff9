"""What builds and checks the guide: pages whose blocks run, a reference made from docstrings, links that are followed."""
