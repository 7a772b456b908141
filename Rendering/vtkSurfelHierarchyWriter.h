// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelHierarchyWriter
 * @brief   writes hierarchies of surfels as files that open by mapping
 *
 * This writer writes the output of vtkSurfelHierarchy, and what the first frame would compute of
 * it, for vtkSurfelHierarchyReader (.surfels, Documentation/DataContract.md). The file takes 48
 * bytes for the node of a surfel, 36 for its colours if the active scalars are colours of 8 bits, 4
 * for the bounds that select the cut, and the point arrays of the surfel. Point and field arrays of
 * numbers are kept; strings and cells are not.
 *
 * It writes the whole file or none. If the file name is a link, its target is written and the link
 * stays.
 *
 * @sa vtkSurfelHierarchyReader vtkSurfelHierarchy
 */
#ifndef vtkSurfelHierarchyWriter_h
#define vtkSurfelHierarchyWriter_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelRenderingModule.h" // for export macro

class VTKSURFELRENDERING_EXPORT vtkSurfelHierarchyWriter : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelHierarchyWriter* New();
  vtkTypeMacro(vtkSurfelHierarchyWriter, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Path of the file. Default none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Updates the input and writes it. Returns 1, or 0 after an error; GetErrorCode() is then not 0.
   */
  int Write();

protected:
  vtkSurfelHierarchyWriter();
  ~vtkSurfelHierarchyWriter() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkSurfelHierarchyWriter(const vtkSurfelHierarchyWriter&) = delete;
  void operator=(const vtkSurfelHierarchyWriter&) = delete;

  char* FileName = nullptr;
};

#endif
