/* SPDX-License-Identifier: Apache-2.0 */
#include "nvm_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define PATH_SIZE 1024

bool nvm_file_load(const char *path, nvm_host_t *nvm)
{
    uint8_t bytes[NVM_HOST_SIZE + 1U];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return errno == ENOENT;
    }
    const size_t read = fread(bytes, 1, sizeof bytes, file);
    const bool good = ferror(file) == 0 && read == NVM_HOST_SIZE;
    (void)fclose(file);
    if (good) {
        memcpy(nvm->slot, bytes, sizeof nvm->slot);
    }
    return good;
}

bool nvm_file_save(const char *path, const nvm_host_t *nvm)
{
    char fresh[PATH_SIZE];
    const int length = snprintf(fresh, sizeof fresh, "%s.new", path);
    FILE *file = length > 0 && length < PATH_SIZE ? fopen(fresh, "wb") : NULL;
    if (file == NULL) {
        return false;
    }
    const bool written = fwrite(nvm->slot, 1, sizeof nvm->slot, file) == sizeof nvm->slot;
    const bool closed = fclose(file) == 0;
    return written && closed && rename(fresh, path) == 0;
}
