#!/bin/sh
# Makes a virtual environment, or brings one up to date, with all that the package needs.
#
#   tools/environment.sh IDENTITY PYTHON FOLDER EXTRAS [CONSTRAINTS]
#
# IDENTITY is a line that says what the environment depends on: when it changes, it is made anew.
# EXTRAS are extras of setup.py, comma-separated. With `ros` among them, ROS 2 comes as wheels;
# without, the environment sees the machine's own packages, ROS 2 among them.
set -eu
identity=$1 python=$2 folder=$3 extras=$4 constraints=${5:-}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' || {
    echo "$python does not run or is older than Python 3.10: name another one with PYTHON=" >&2
    exit 1
}
if [ -n "$constraints" ] && [ ! -r "$constraints" ]; then
    echo "$constraints cannot be read: name a pip constraints file with CONSTRAINTS=" >&2
    exit 1
fi

case ,$extras, in
    *,ros,*) sight='' ;;
    *) sight=--system-site-packages ;;
esac

if [ "$(cat "$folder/identity" 2>/dev/null)" != "$identity" ]; then
    echo "Making $folder: a minute or two, once."
    rm -rf "$folder"
    if ! "$python" -m venv $sight "$folder" >/dev/null 2>&1; then
        # Debian and Ubuntu keep ensurepip in python3-venv; the pip that is there does as well.
        rm -rf "$folder"
        "$python" -m venv $sight --without-pip "$folder"
        "$python" -m pip install -qq --target "$("$folder/bin/python" -c \
            'import sysconfig; print(sysconfig.get_path("purelib"))')" pip
    fi
    touch "$folder/COLCON_IGNORE"
    printf '%s\n' "$identity" > "$folder/identity"
fi

# What is never imported need not be compiled to bytecode, which takes as long as all the rest.
pip_install() {
    "$folder/bin/python" -m pip install -qq --disable-pip-version-check --no-compile \
        ${constraints:+--constraint "$constraints"} "$@"
}
# Resolving takes the pip that comes with Python 3.11 and 3.12 minutes.
upgrade_pip() {
    pip_install --upgrade pip || echo "$folder keeps the pip that it came with" >&2
}
install() {
    if [ -n "$uv" ]; then
        "$uv" pip install -q --python "$folder/bin/python" \
            ${constraints:+--constraint "$constraints"} "$@" && return
        echo 'uv could not install that: pip does' >&2
        uv=''
        upgrade_pip
    fi
    pip_install "$@"
}

# uv takes a quarter of pip's time. It sees neither the machine's own packages nor another index that
# pip was told of, where pip does all.
uv=''
case ,$extras, in
    *,ros,*)
        if ! "$folder/bin/python" -m pip config list | grep '[.]index-url=' >/dev/null &&
                pip_install uv; then
            uv=$folder/bin/uv
        fi ;;
esac
[ -n "$uv" ] || upgrade_pip
# colcon still calls `setup.py install`, which setuptools 80 gave up; colcon-core bounds it, too.
install 'setuptools<80'
colcon='colcon-core colcon-ros colcon-output colcon-package-information colcon-package-selection
    colcon-bash colcon-zsh'
# The words are requirements, none of which holds a space.
# shellcheck disable=SC2046,SC2086
install wheel $colcon $("$folder/bin/python" tools/requirements.py "$extras")
