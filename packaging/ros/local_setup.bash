AMENT_CURRENT_PREFIX=$(builtin cd "$(dirname "${BASH_SOURCE[0]}")/../.." >/dev/null && pwd)
. "$AMENT_CURRENT_PREFIX/share/trestle/local_setup.sh"
unset AMENT_CURRENT_PREFIX
