# What the shell tests share: counters, and the closing line. To be read in with "." by each.
# With check_every=1 what passes gets a line too: "PASS name", "FAIL name" or "SKIP name".

check_passed=0
check_failed=0
check_skipped=0
check_every=${check_every:-}

# check "behaviour" command...: the command is to succeed.
check()
{
    check_name=$1
    shift
    if "$@"; then
        check_passed=$((check_passed + 1))
        [ -z "$check_every" ] || echo "PASS $check_name"
    else
        check_failed=$((check_failed + 1))
        [ -n "$check_every" ] && echo "FAIL $check_name" || echo "FAILED $check_name"
    fi
}

# prints_nothing command...: for lists of faults; shows what the command prints.
prints_nothing()
{
    faults=$("$@" 2>&1)
    [ -z "$faults" ] || { echo "$faults" | head -n 20; false; }
}

skip()
{
    check_skipped=$((check_skipped + 1))
    [ -n "$check_every" ] && echo "SKIP $*" || echo "skipped $*"
}

# Prints the closing line; its code is that of the test.
check_report()
{
    if [ "$check_skipped" -eq 0 ]; then
        echo "$check_passed passed, $check_failed failed"
    else
        echo "$check_passed passed, $check_failed failed, $check_skipped skipped"
    fi
    [ "$check_failed" -eq 0 ]
}
