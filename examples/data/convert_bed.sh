#!/usr/bin/env bash
# convert_bed.sh bed_25k.txt > bed_25k.csv: from "radius x y z" to what a population reads; leaves out the last line, the intruder.
set -eu
echo "# Bed of 25,000 spheres, Dosta et al., Comput. Phys. Commun. 296 (2024) 109066; MercuryDPM, BSD-3-Clause (README.md)"
echo "x,y,z,radius"
awk '{ gsub("\r", "") } NR > 1 && NF == 4 { print $2 "," $3 "," $4 "," $1 }' "$1"
