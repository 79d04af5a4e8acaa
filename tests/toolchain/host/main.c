/* host LIBRARY DESCRIPTION ACTION [ARGUMENT [SEED]]: does one thing with an FMU; exit status 0 if all was as
   expected. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "importer.h"

int main(int count, char *arguments[]) {
    static Fmu fmu;
    expect(count >= 4, "usage: host LIBRARY DESCRIPTION ACTION [ARGUMENT [SEED]]");
    const char *action = arguments[3], *argument = count > 4 ? arguments[4] : "0";
    load(&fmu, arguments[1], arguments[2]);
    if (strcmp(action, "cycles") == 0) {
        cycles(&fmu, atoi(argument));
    } else if (strcmp(action, "threads") == 0) {
        threads(&fmu, atoi(argument));
    } else if (strcmp(action, "move") == 0) {
        move(&fmu);
    } else if (strcmp(action, "save") == 0) {
        save(&fmu, argument);
    } else if (strcmp(action, "go_on") == 0) {
        go_on(&fmu, argument);
    } else if (strcmp(action, "random_calls") == 0) {
        random_calls(&fmu, atoi(argument), count > 5 ? strtoull(arguments[5], NULL, 10) : 1);
    } else if (strcmp(action, "forge") == 0) {
        forge(&fmu, atoi(argument));
    } else if (strcmp(action, "leak") == 0) {
        leak(&fmu);
    } else if (strcmp(action, "overrun") == 0) {
        overrun(&fmu);
    } else if (strcmp(action, "race") == 0) {
        race(&fmu);
    } else {
        expect(0, "there is no action %s", action);
    }
    return 0;
}
