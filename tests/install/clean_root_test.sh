#!/usr/bin/env bash
# The packages that `./run packages` makes, installed and used in a system of Debian's base alone. By hand, as root, after
# `./run packages` and `./run build`, with debootstrap and a network; some minutes and 2 GB:
#
#   tests/install/clean_root_test.sh [FOLDER]     # a system that is there already is taken as it is; default: a new one
set -euo pipefail

tree=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
root=${1-$(mktemp -d)}
((EUID == 0)) || {
    echo "clean_root_test: to be run as root" >&2
    exit 2
}
for needed in "$tree"/build/packages/clarus_*.deb "$tree"/build/tests/readme_example_c.c; do
    [[ -e $needed ]] || {
        echo "clean_root_test: no $needed: ./run packages and ./run build make it" >&2
        exit 2
    }
done

[[ -e $root/etc/debian_version ]] || debootstrap --variant=minbase bookworm "$root" ${MIRROR+"$MIRROR"}
# From where this machine has its packages.
cp -a /etc/apt/. "$root/etc/apt/"
mkdir -p "$root/clarus"
cp "$tree"/build/packages/*.deb "$tree"/build/tests/readme_example_c.c "$tree"/build/tests/readme_example_cpp.cpp "$root/clarus/"
for folder in proc dev sys; do mount --bind "/$folder" "$root/$folder"; done
trap 'for folder in sys dev proc; do umount "$root/$folder"; done' EXIT

chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive bash -euxo pipefail -c '
    install="apt-get install -q -y --no-install-recommends"
    cd /clarus
    apt-get update -q
    $install ./libclarus0_*.deb ./libclarus-share0_*.deb ./clarus_*.deb ./clarus-models_*.deb pocl-opencl-icd
    clarus --version
    clarus devices
    rm -rf sequence upscaled
    clarus render --scene demo --size 96x54 --frames 2 -o sequence
    clarus upscale sequence --model enss-s-x2 -o upscaled
    clarus compare upscaled sequence
    clarus check sequence

    $install ./libclarus-dev_*.deb gcc g++ pkg-config ocl-icd-opencl-dev libclblast-dev libfmt-dev
    gcc readme_example_c.c -o in_c $(pkg-config --cflags --libs clarus)
    g++ -std=c++20 readme_example_cpp.cpp -o in_cpp $(pkg-config --cflags --libs clarus)
    gcc readme_example_c.c -o static_in_c $(pkg-config --cflags --libs --static clarus-static)
    for program in in_c in_cpp static_in_c; do ./$program; done

    apt-get purge -q -y clarus clarus-models libclarus-dev libclarus0 libclarus-share0
    left=$(find /usr -path "*clarus*" -print -quit)
    [[ -z $left ]]
'
echo "The packages install, work, build programs and go without a trace."
