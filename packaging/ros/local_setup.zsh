AMENT_CURRENT_PREFIX=$(builtin cd -q "$(dirname "${(%):-%N}")/../.." >/dev/null && pwd)
. "$AMENT_CURRENT_PREFIX/share/trestle/local_setup.sh"
unset AMENT_CURRENT_PREFIX
