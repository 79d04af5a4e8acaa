/* host ACTION [ARGUMENT [SEED]]: does one thing with the FMU; exit status 0 if all was as expected. */
#include <stdlib.h>
#include <string.h>

#include "host3.h"

int main(int count, char *arguments[]) {
    expect(count >= 2, "usage: host ACTION [ARGUMENT [SEED]]");
    const char *action = arguments[1], *argument = count > 2 ? arguments[2] : "0";
    if (strcmp(action, "random_calls") == 0) {
        random_calls(atoi(argument), count > 3 ? strtoull(arguments[3], NULL, 10) : 1);
    } else if (strcmp(action, "cycles") == 0) {
        cycles(atoi(argument));
    } else if (strcmp(action, "threads") == 0) {
        threads(atoi(argument));
    } else if (strcmp(action, "move") == 0) {
        move();
    } else if (strcmp(action, "save") == 0) {
        save(argument);
    } else if (strcmp(action, "go_on") == 0) {
        go_on(argument);
    } else {
        expect(0, "there is no action %s", action);
    }
    return 0;
}
