// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelHierarchyReader
 * @brief   opens hierarchies of surfels by mapping their file
 *
 * This reader opens the files of vtkSurfelHierarchyWriter (.surfels). Its output is the hierarchy
 * that was written, for a vtkSurfelMapper. It takes milliseconds and hardly any memory, however
 * large the file is: the arrays stay in the file, and the operating system reads those pages of it
 * that a frame needs. So clouds can be larger than the memory. The pictures are those of the
 * hierarchy in memory, bit by bit.
 *
 * The output has no cells: VTK's own mappers draw nothing of it. What is written into its arrays
 * stays in this process; call Modified() of such an array. The file must not be changed while its
 * arrays exist; vtkSurfelHierarchyWriter replaces files as a whole.
 *
 * A file that is damaged, not whole, or of another version is an error. Of files larger than 32 MB
 * header and sizes are checked when they are opened, and each page before a picture needs it for
 * the first time: vtkSurfelSplatter then reports the damage and makes no picture. CheckFile()
 * checks all of it.
 *
 * @sa vtkSurfelHierarchyWriter vtkSurfelHierarchy vtkSurfelMapper
 */
#ifndef vtkSurfelHierarchyReader_h
#define vtkSurfelHierarchyReader_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelRenderingModule.h" // for export macro

class VTKSURFELRENDERING_EXPORT vtkSurfelHierarchyReader : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelHierarchyReader* New();
  vtkTypeMacro(vtkSurfelHierarchyReader, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Path of the file. Default none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Reads and checks the whole file. Returns whether it is what was written; otherwise reports an
   * error that says what is damaged.
   */
  bool CheckFile();

protected:
  vtkSurfelHierarchyReader();
  ~vtkSurfelHierarchyReader() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkSurfelHierarchyReader(const vtkSurfelHierarchyReader&) = delete;
  void operator=(const vtkSurfelHierarchyReader&) = delete;

  void ReportError(const char* problem);

  char* FileName = nullptr;
};

#endif
