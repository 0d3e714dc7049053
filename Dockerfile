# docker build -t bushcli . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/case" bushcli direct case.toml -o out
# With --user the results belong to whoever runs it, and not to root.
FROM debian:trixie-slim

COPY setup/packages.txt /tmp/packages.txt
RUN apt-get update \
    && awk '!/^#/ && NF && $1 != "-" { print $1 }' /tmp/packages.txt \
       | DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends \
    && rm -rf /var/lib/apt/lists/*

# A virtual environment of its own, because Debian's Python leaves installing to apt.
# What Debian does not have comes from PyPI in the versions of the lock file, with their hashes.
COPY . /src
RUN python3 -m venv --system-site-packages --without-pip /opt/bushcli \
    && for wanted in "hatchling setuptools" "bushcli[rig,fmu,study]"; do \
         /opt/bushcli/bin/python /src/setup/locked.py $wanted >/tmp/missing.txt || exit 1; \
         [ ! -s /tmp/missing.txt ] || /opt/bushcli/bin/python -m pip install --no-cache-dir --no-deps \
             --require-hashes --no-build-isolation -r /tmp/missing.txt || exit 1; \
       done \
    && /opt/bushcli/bin/python -m pip install --no-cache-dir --no-deps --no-build-isolation /src \
    && rm -rf /src /tmp/missing.txt

# The same settings as setup/venv.sh makes, for the same reasons.
ENV PATH=/opt/bushcli/bin:$PATH \
    OMP_NUM_THREADS=1 \
    OMPI_ALLOW_RUN_AS_ROOT=1 \
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
    OMPI_MCA_btl=self,sm \
    BUSHCLI_CACHE=/opt/bushcli/kernels \
    MPLCONFIGDIR=/tmp/matplotlib

# Kernels are part of the image: a container that is removed after its run would compile them each time. On another kind
# of processor they are compiled again, by whatever user runs it.
RUN python -m cases.precompile && chmod -R a+rwX /opt/bushcli/kernels

WORKDIR /case
ENTRYPOINT ["bushcli"]
CMD ["--help"]
